#!/usr/bin/env python3
"""Draws a saved state of a results file: the grains where they are, coloured by a quantity.

    scripts/plot_specimen.py results/a.vtkhdf --out specimen.png
    scripts/plot_specimen.py results/a.vtkhdf --state -1 --colour displacement --cut --out final.png
    scripts/plot_specimen.py results/a.vtkhdf --state 0 -1 --out before_after.png

Needs numpy and matplotlib only: the picture is rasterised here, without a display or a graphics driver.
"""

import argparse
import sys

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy
from matplotlib.colors import Normalize

from riprap_results import Results, ResultsError

QUANTITIES = {
    # name: (label, unit factor, colour map)
    "displacement": ("displacement  [mm]", 1e3, "viridis"),
    "damage": ("damage  [-]", 1, "OrRd"),
    "von_mises": ("von Mises stress  [MPa]", 1e-6, "YlOrRd"),
    "youngs_modulus": ("Young's modulus  [GPa]", 1e-9, "cividis"),
    "grain": (None, 1, None),
}
# Greys and browns of broken rock; grains take them in a fixed shuffled order.
ROCK = ["#b9a88f", "#a38f74", "#8c7b66", "#c9bca6", "#9b9a94", "#7f7a72", "#b3a79a", "#d3c7b1", "#877057", "#a9a49b"]
NOTHING = matplotlib.colors.to_rgb("#d9dde2")
TOWARDS_VIEWER = numpy.array([0.45, -1.0, 0.28]) / numpy.linalg.norm([0.45, -1.0, 0.28])
FACES_TET10 = [(0, 2, 1, 6, 5, 4), (0, 1, 3, 4, 8, 7), (1, 2, 3, 5, 9, 8), (0, 3, 2, 7, 9, 6)]


def surface(results, state, hidden_parts, cut):
    """Triangles of the outside of all cells that stand: points [m], triangles, cell and point of each value."""
    types, connectivity, offsets = results.cells()
    points = results.points + results.point_data("displacement", state)
    part = results.cell_data("part", state)
    grain = results.cell_data("grain", state)
    standing = ~(results.cell_data("failed", state).astype(bool))
    names = results.parts
    visible = standing & ~numpy.isin(part, [at for at, name in enumerate(names) if name in hidden_parts])
    if cut:
        reference = results.points
        middle = 0.5 * (reference.min(axis=0) + reference.max(axis=0))
        first = connectivity[offsets[:-1]]
        # Whole grains are cut away, by their middles, so that their faces show.
        for number in numpy.unique(grain[grain >= 0]):
            if reference[first[grain == number], 1].mean() < middle[1]:
                visible &= grain != number
    triangles, owners = [], []
    tets = numpy.flatnonzero(visible & (types == 24))
    if len(tets):
        nodes = connectivity[offsets[tets][:, None] + numpy.arange(10)]
        # Corner order of a face outward, its mid-side nodes after: a b c ab bc ca.
        faces = numpy.concatenate([nodes[:, list(face)] for face in FACES_TET10])
        cells = numpy.tile(tets, 4)
        keys = numpy.sort(faces[:, :3], axis=1)
        _, index, counts = numpy.unique(keys, axis=0, return_index=True, return_counts=True)
        outside = index[counts == 1]
        corners = faces[outside][:, :3]
        triangles.append(corners)
        owners.append(cells[outside])
    for kind, splits in [(5, [(0, 1, 2)]), (9, [(0, 1, 2), (0, 2, 3)])]:
        flat = numpy.flatnonzero(visible & (types == kind))
        if len(flat):
            nodes = connectivity[offsets[flat][:, None] + numpy.arange(3 if kind == 5 else 4)]
            for split in splits:
                triangles.append(nodes[:, list(split)])
                owners.append(flat)
    if not triangles:
        raise ResultsError(f"{results.path}: nothing to draw")
    return points, numpy.concatenate(triangles), numpy.concatenate(owners)


def values_of(results, state, name, triangles, owners):
    factor = QUANTITIES[name][1]
    if name == "displacement":
        size = numpy.linalg.norm(results.point_data(name, state), axis=1)
        return factor * size[triangles].mean(axis=1)
    return factor * results.cell_data(name, state)[owners]


def colours_of(results, state, name, triangles, owners, limits):
    grain = results.cell_data("grain", state)[owners]
    if name == "grain":
        order = numpy.random.default_rng(7).permutation(grain.max() + 2)
        palette = numpy.array([matplotlib.colors.to_rgb(colour) for colour in ROCK])
        rgb = palette[order[grain] % len(palette)]
    else:
        values = values_of(results, state, name, triangles, owners)
        rgb = plt.get_cmap(QUANTITIES[name][2])(Normalize(*limits)(numpy.nan_to_num(values)))[:, :3]
        rgb[~numpy.isfinite(values)] = NOTHING
    rgb[grain < 0] = NOTHING
    return rgb


def rasterise(corners, height, width):
    """Which triangle each pixel shows (-1 for none), and its depth; corners in pixels, third axis towards the viewer.

    Every pixel of a triangle's bounding box is tried; the foremost triangle wins. Depth and number of a triangle share one
    64-bit key, so that one maximum finds both.
    """
    low = numpy.clip(numpy.floor(corners[:, :, :2].min(axis=1)), 0, [width - 1, height - 1]).astype(numpy.int64)
    high = numpy.clip(numpy.ceil(corners[:, :, :2].max(axis=1)), 0, [width - 1, height - 1]).astype(numpy.int64)
    spans = high - low + 1
    counts = spans.prod(axis=1)
    a, b, c = corners[:, 0], corners[:, 1], corners[:, 2]
    area = (b[:, 0] - a[:, 0]) * (c[:, 1] - a[:, 1]) - (b[:, 1] - a[:, 1]) * (c[:, 0] - a[:, 0])
    front = numpy.flatnonzero(area > 1e-9)
    depth_low = corners[:, :, 2].min()
    depth_scale = (2**31 - 1) / max(numpy.ptp(corners[:, :, 2]), 1e-300)
    keys = numpy.full(height * width, -1, dtype=numpy.int64)
    ends = numpy.cumsum(counts[front])
    start = 0
    while start < len(front):
        # About four million trials at a time.
        stop = max(start + 1, numpy.searchsorted(ends, (ends[start - 1] if start else 0) + 4_000_000))
        batch = front[start:stop]
        start = stop
        of = numpy.repeat(batch, counts[batch])
        first = numpy.repeat(numpy.cumsum(counts[batch]) - counts[batch], counts[batch])
        number = numpy.arange(len(of)) - first
        x = low[of, 0] + number % spans[of, 0]
        y = low[of, 1] + number // spans[of, 0]
        weight_b = (x - a[of, 0]) * (c[of, 1] - a[of, 1]) - (y - a[of, 1]) * (c[of, 0] - a[of, 0])
        weight_c = (b[of, 0] - a[of, 0]) * (y - a[of, 1]) - (b[of, 1] - a[of, 1]) * (x - a[of, 0])
        weight_b, weight_c = weight_b / area[of], weight_c / area[of]
        inside = (weight_b >= 0) & (weight_c >= 0) & (weight_b + weight_c <= 1)
        of, x, y, weight_b, weight_c = of[inside], x[inside], y[inside], weight_b[inside], weight_c[inside]
        depth = a[of, 2] + weight_b * (b[of, 2] - a[of, 2]) + weight_c * (c[of, 2] - a[of, 2])
        key = ((depth - depth_low) * depth_scale).astype(numpy.int64) << 32 | of
        numpy.maximum.at(keys, y * width + x, key)
    keys = keys.reshape(height, width)
    shown = numpy.where(keys >= 0, keys & 0xFFFFFFFF, -1)
    depth = numpy.where(keys >= 0, (keys >> 32) / depth_scale + depth_low, -numpy.inf)
    return shown, depth


def occlusion(depth, normals, radius):
    """How much of the sky over each pixel its neighbours hide, 0 to 1: what stands out of the pixel's own plane."""
    hidden = numpy.zeros(depth.shape)
    slope = -normals[..., :2] / numpy.maximum(normals[..., 2:], 0.2)
    samples = 28
    for at in range(samples):
        reach = radius * ((at + 1) / samples) ** 1.2
        angle = 2.399963 * at  # golden angle: spreads any number of samples evenly
        dx, dy = int(round(reach * numpy.cos(angle))), int(round(reach * numpy.sin(angle)))
        there = numpy.full(depth.shape, -numpy.inf)
        rows, columns = depth.shape
        there[max(-dy, 0) : rows - max(dy, 0), max(-dx, 0) : columns - max(dx, 0)] = depth[
            max(dy, 0) : rows - max(-dy, 0), max(dx, 0) : columns - max(-dx, 0)
        ]
        with numpy.errstate(invalid="ignore"):  # of the background, which is dropped below
            above = there - (depth + slope[..., 0] * dx + slope[..., 1] * dy)
        # Distant things in front of a pixel do not darken it.
        hidden += numpy.clip(above / (0.5 * reach + 1), 0, 1) * (above < 3 * radius)
    return numpy.nan_to_num(hidden / samples)


def render(points, triangles, two_sided, rgb, size, view):
    """One picture as an array (height, width, 3): flat shading, two lights, soft shade in the gaps."""
    axes, middle, tall = view
    width, height = 2 * size[0], 2 * size[1]  # twice the size, averaged at the end: smooth edges
    scale = height / tall
    seen = (points @ axes.T - middle) * scale
    seen[:, :2] += [0.5 * width, 0.5 * height]
    corners = seen[triangles]
    normals = numpy.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    normals /= numpy.maximum(numpy.linalg.norm(normals, axis=1, keepdims=True), 1e-300)
    # Plates are seen from either side.
    back = normals[:, 2] < 0
    turn = back & two_sided
    corners[turn] = corners[turn][:, ::-1]
    normals[turn] *= -1
    shown, depth = rasterise(corners, height, width)
    at = numpy.maximum(shown, 0)
    normal = normals[at]
    light = numpy.full(shown.shape, 0.36)
    for direction, strength in [((-0.55, 0.65, 0.6), 0.78), ((0.9, 0.15, 0.35), 0.30)]:
        direction = numpy.array(direction) / numpy.linalg.norm(direction)
        light += strength * numpy.clip(normal @ direction, 0, None)
    light *= 1 - 0.85 * occlusion(depth, normal, 0.018 * height) ** 0.8
    picture = rgb[at] * light[..., None]
    picture[shown < 0] = 1
    picture = picture.reshape(size[1], 2, size[0], 2, 3).mean(axis=(1, 3))
    return numpy.clip(picture[::-1], 0, 1)


def caption(results, state):
    increment = int(results.state_increments[state])
    if increment == 0:
        return "start"
    at = numpy.flatnonzero(results.history["increment"] == increment)
    if not len(at) or not numpy.isfinite(results.history["axial_strain"][at[0]]):
        return f"increment {increment}"
    return f"axial strain {100 * results.history['axial_strain'][at[0]]:.2f} %"


def draw(results, states, name, hidden_parts, cut, limits, longer_side):
    surfaces = [surface(results, state, hidden_parts, cut) for state in states]
    shown = numpy.concatenate([points[numpy.unique(triangles)] for points, triangles, _ in surfaces])
    # Extents on the picture's axes, so that it is filled.
    right = numpy.cross([0, 0, 1], TOWARDS_VIEWER)
    right /= numpy.linalg.norm(right)
    axes = numpy.array([right, numpy.cross(TOWARDS_VIEWER, right), TOWARDS_VIEWER])
    seen = shown @ axes.T
    low, high = seen.min(axis=0), seen.max(axis=0)
    wide, tall, _ = 1.04 * (high - low)
    view = (axes, 0.5 * (low + high), tall)
    pixels = (max(1, round(longer_side * min(1, wide / tall))), max(1, round(longer_side * min(1, tall / wide))))
    if name != "grain" and limits is None:
        everything = []
        for (_, triangles, owners), state in zip(surfaces, states):
            on_grains = results.cell_data("grain", state)[owners] >= 0
            everything.append(values_of(results, state, name, triangles, owners)[on_grains])
        everything = numpy.concatenate(everything)
        # Bodies that are held have no stress of their own.
        everything = everything[numpy.isfinite(everything)]
        if not len(everything):
            raise ResultsError(f"{results.path}: no {name} is known in these states")
        limits = (min(0, everything.min()), max(numpy.percentile(everything, 99.5), 1e-12))
    pictures = []
    for (points, triangles, owners), state in zip(surfaces, states):
        rgb = colours_of(results, state, name, triangles, owners, limits)
        two_sided = results.cell_data("grain", state)[owners] < 0
        pictures.append(render(points, triangles, two_sided, rgb, pixels, view))
    inches = 5.6 * pixels[1] / max(pixels)
    width = 5.6 * pixels[0] / max(pixels)
    bar = 0 if name == "grain" else 0.9
    figure = plt.figure(figsize=(width * len(states) + bar, inches + 0.45))
    full = width * len(states) + bar
    for at, (picture, state) in enumerate(zip(pictures, states)):
        ax = figure.add_axes([at * width / full, 0, width / full, inches / (inches + 0.45)])
        ax.imshow(picture, interpolation="antialiased")
        ax.set_axis_off()
        ax.set_title(caption(results, state), fontsize=11, color="#333333")
    if name != "grain":
        ax = figure.add_axes([(full - bar + 0.05) / full, 0.2, 0.16 / full, 0.5])
        mappable = plt.cm.ScalarMappable(Normalize(*limits), QUANTITIES[name][2])
        colours = figure.colorbar(mappable, cax=ax)
        colours.set_label(QUANTITIES[name][0])
        colours.outline.set_visible(False)
    return figure


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("file", help="results file (.vtkhdf, .h5)")
    parser.add_argument("--out", required=True, help="picture to write (.png)")
    parser.add_argument("--state", type=int, nargs="+", default=[-1], help="saved states, side by side; -1 is the last")
    parser.add_argument("--colour", choices=QUANTITIES, default="grain", help="what the colours show (default: grain)")
    parser.add_argument("--range", type=float, nargs=2, metavar=("LOW", "HIGH"), help="limits of the colours, in the unit shown")
    parser.add_argument("--hide", nargs="*", default=["membrane"], metavar="PART", help="parts to leave out (default: membrane)")
    parser.add_argument("--cut", action="store_true", help="take the front half of the grains away")
    parser.add_argument("--size", type=int, default=1000, help="pixels of a picture's longer side (default: 1000)")
    options = parser.parse_args()
    try:
        with Results(options.file) as results:
            count = len(results.states)
            for state in options.state:
                if not -count <= state < count:
                    raise ResultsError(f"{options.file}: no state {state}; there are {count}")
            limits = tuple(options.range) if options.range else None
            figure = draw(results, options.state, options.colour, options.hide, options.cut, limits, options.size)
        figure.savefig(options.out, dpi=max(60, 0.18 * options.size), facecolor="white")
    except (ResultsError, OSError) as error:
        sys.exit(f"plot_specimen: {error}")
    print(options.out)


if __name__ == "__main__":
    main()
