// The specimen in three dimensions: raw WebGL 2, no library. One view for each figure of the class "viewer", with its data beside it.
(function () {
  const VERTEX = `#version 300 es
in vec3 place; in vec3 colour; uniform mat4 turn; out vec3 at; out vec3 paint;
void main() { at = place; paint = colour; gl_Position = turn * vec4(place, 1.0); }`;
  const FRAGMENT = `#version 300 es
precision highp float;
in vec3 at; in vec3 paint; uniform vec3 eye; uniform float opacity; uniform float lit; out vec4 shown;
void main() {
  vec3 normal = normalize(cross(dFdx(at), dFdy(at)));
  float light = mix(1.0, abs(dot(normal, normalize(eye))) * 0.65 + 0.35, lit);
  shown = vec4(paint * light, opacity);
}`;
  const ORANGE = [0.84, 0.37, 0.0];

  const bytes = text => Uint8Array.from(atob(text), c => c.charCodeAt(0)).buffer;
  // Of colours at even shares from 0 to 1, 0 to 255 each.
  const shade = (scale, share) => {
    const last = scale.length - 1, x = last * Math.min(1, Math.max(0, share)), k = Math.min(Math.floor(x), last - 1);
    return scale[k].map((a, j) => (a + (scale[k + 1][j] - a) * (x - k)) / 255);
  };
  const rock = owner => {
    const h = Math.abs(Math.sin(owner * 12.9898) * 43758.5453) % 1;
    return [0.48 + 0.3 * h, 0.44 + 0.27 * h, 0.38 + 0.22 * h];
  };
  const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
  const minus = (a, b) => a.map((x, j) => x - b[j]);

  function view(figure) {
    const canvas = figure.querySelector('canvas'), part = name => figure.querySelector('[name=' + name + ']');
    const gl = canvas.getContext('webgl2', { alpha: false, antialias: true, preserveDrawingBuffer: true });
    if (!gl) { figure.querySelector('.label').textContent = 'this view needs WebGL 2'; return; }
    const data = JSON.parse(figure.querySelector('script').textContent);
    const places = new Uint16Array(bytes(data.places)), corners = new Uint32Array(bytes(data.corners));
    const owners = new Int32Array(bytes(data.owners)), damage = new Uint8Array(bytes(data.damage));
    const triangles = owners.length, low = data.low, span = minus(data.high, low);
    const centre = low.map((a, j) => a + span[j] / 2), radius = Math.hypot(...span) / 2 || 1;

    const compile = (kind, text) => { const s = gl.createShader(kind); gl.shaderSource(s, text); gl.compileShader(s); return s; };
    const program = gl.createProgram();
    gl.attachShader(program, compile(gl.VERTEX_SHADER, VERTEX));
    gl.attachShader(program, compile(gl.FRAGMENT_SHADER, FRAGMENT));
    gl.linkProgram(program);
    gl.useProgram(program);
    const uniform = name => gl.getUniformLocation(program, name);
    const attribute = name => {
      const buffer = gl.createBuffer(), at = gl.getAttribLocation(program, name);
      gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
      gl.enableVertexAttribArray(at);
      gl.vertexAttribPointer(at, 3, gl.FLOAT, false, 0, 0);
      return buffer;
    };
    const placeBuffer = attribute('place'), colourBuffer = attribute('colour');
    gl.enable(gl.DEPTH_TEST);
    const put = (buffer, values) => { gl.bindBuffer(gl.ARRAY_BUFFER, buffer); gl.bufferData(gl.ARRAY_BUFFER, values, gl.DYNAMIC_DRAW); };
    const paint = (points, colours, opacity, lit) => {
      put(placeBuffer, points); put(colourBuffer, colours);
      gl.uniform1f(uniform('opacity'), opacity); gl.uniform1f(uniform('lit'), lit);
      gl.drawArrays(gl.TRIANGLES, 0, points.length / 3);
    };

    const at = (state, corner, j) => low[j] + span[j] * places[(state * data.corner_count + corner) * 3 + j] / 65535;
    const points = new Float32Array(triangles * 9), colours = new Float32Array(triangles * 9);
    let yaw = -1.15, pitch = 0.25, zoom = 1;

    function surface(state, by) {
      const moved = new Float32Array(triangles * 3);
      for (let i = 0; i < triangles * 3; i++) {
        let square = 0;
        for (let j = 0; j < 3; j++) {
          const x = at(state, corners[i], j), d = x - at(data.reference, corners[i], j);
          points[3 * i + j] = x - centre[j];
          square += d * d;
        }
        moved[i] = Math.sqrt(square);
      }
      // What 99.5 % of the corners on grains stay below: one that broke off does not darken all others.
      const ways = moved.filter((_, i) => owners[Math.floor(i / 3)] >= 0).sort();
      const most = ways.length ? ways[Math.min(Math.floor(0.995 * ways.length), ways.length - 1)] : 0;
      for (let i = 0; i < triangles * 3; i++) {
        const t = Math.floor(i / 3);
        const c = by === 'displacement' ? shade(data.displacement_colours, moved[i] / (most || 1))
          : by === 'damage' ? shade(data.damage_colours, damage[state * triangles + t] / 255) : rock(owners[t]);
        colours.set(c, 3 * i);
      }
      return by === 'displacement' ? ', yellow: moved by ' + (1e3 * most).toPrecision(3) + ' mm or more' : '';
    }

    // Bars between the centres of grains, turned to the viewer, as thick as the force over its mean.
    function bars(state, eye) {
      const [ends, forces] = [data.lines[state], data.forces[state]], list = [], hue = [];
      forces.forEach((force, k) => {
        const a = ends.slice(6 * k, 6 * k + 3).map((x, j) => x - centre[j]), b = ends.slice(6 * k + 3, 6 * k + 6).map((x, j) => x - centre[j]);
        const side = cross(minus(b, a), eye), length = Math.hypot(...side) || 1, half = 0.004 * radius * Math.min(force, 8);
        const off = side.map(x => x / length * half);
        for (const [p, sign] of [[a, 1], [a, -1], [b, 1], [b, 1], [a, -1], [b, -1]]) {
          list.push(...p.map((x, j) => x + sign * off[j]));
          hue.push(...ORANGE);
        }
      });
      return [new Float32Array(list), new Float32Array(hue)];
    }

    function draw() {
      const state = Number(part('state').value), withForces = part('forces') && part('forces').checked;
      const told = surface(state, part('paint').value);
      figure.querySelector('.label').textContent = data.labels[state] + told;
      const width = canvas.width = canvas.clientWidth * devicePixelRatio, height = canvas.height = canvas.clientHeight * devicePixelRatio;
      gl.viewport(0, 0, width, height);
      gl.clearColor(1, 1, 1, 1);
      gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
      const [cy, sy, cp, sp] = [Math.cos(yaw), Math.sin(yaw), Math.cos(pitch), Math.sin(pitch)];
      const eye = [cy * cp, sy * cp, sp], right = [-sy, cy, 0], up = [-cy * sp, -sy * sp, cp];
      const scale = zoom / radius, x = scale * Math.min(1, height / width), y = scale * Math.min(1, width / height);
      gl.uniformMatrix4fv(uniform('turn'), false, new Float32Array([0, 1, 2].flatMap(j => [right[j] * x, up[j] * y, -eye[j] * 0.4 * scale, 0]).concat([0, 0, 0, 1])));
      gl.uniform3fv(uniform('eye'), eye);
      if (!withForces) { gl.disable(gl.BLEND); paint(points, colours, 1, 1); return; }
      gl.enable(gl.BLEND);
      gl.blendFunc(gl.SRC_ALPHA, gl.ONE_MINUS_SRC_ALPHA);
      paint(...bars(state, eye), 1, 0);
      gl.depthMask(false);
      paint(points, colours, 0.13, 1);
      gl.depthMask(true);
    }

    part('state').max = data.labels.length - 1;
    for (const control of figure.querySelectorAll('input,select')) control.oninput = draw;
    // One pointer turns, two zoom; what a finger wipes up or down scrolls the page.
    const held = new Map();
    const apart = () => { const [a, b] = held.values(); return Math.hypot(a[0] - b[0], a[1] - b[1]) || 1; };
    canvas.onpointerdown = e => { held.set(e.pointerId, [e.clientX, e.clientY]); canvas.setPointerCapture(e.pointerId); };
    canvas.onpointerup = canvas.onpointercancel = e => { held.delete(e.pointerId); };
    canvas.onpointermove = e => {
      if (!held.has(e.pointerId)) return;
      const [x, y] = held.get(e.pointerId), before = held.size === 2 ? apart() : 0;
      held.set(e.pointerId, [e.clientX, e.clientY]);
      if (held.size === 2) {
        zoom *= apart() / before;
      } else {
        yaw -= (e.clientX - x) * 0.008;
        pitch = Math.max(-1.5, Math.min(1.5, pitch + (e.clientY - y) * 0.008));
      }
      draw();
    };
    // The wheel alone scrolls the page.
    canvas.addEventListener('wheel', e => { if (e.ctrlKey || e.shiftKey) { zoom *= Math.exp(-(e.deltaY || e.deltaX) * 0.002); draw(); e.preventDefault(); } }, { passive: false });
    addEventListener('resize', draw);
    // For links and pictures: #viewer=state,paint,forces
    const asked = /viewer=(\d+),(\w+),(\d)/.exec(location.hash);
    if (asked) { part('state').value = asked[1]; part('paint').value = asked[2]; if (part('forces')) part('forces').checked = asked[3] === '1'; }
    draw();
  }
  document.querySelectorAll('figure.viewer').forEach(view);
})();
