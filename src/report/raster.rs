//! Triangles into pixels, without a display: depth buffer, two lights, shade in the gaps, ink between grains.

use rayon::prelude::*;

use crate::tensor::Vec3;

use super::image::Image;
use super::palette::{Colour, WHITE};
use super::surface::Triangle;

/// How a scene is looked at, along parallel rays.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct View {
    /// To the right, upwards and towards the viewer; orthonormal.
    pub axes: [Vec3; 3],
    /// What is in the middle of the picture, on those axes [m].
    pub middle: [f64; 2],
    /// Pixels per metre.
    pub scale: f64,
}

impl View {
    /// Seen from the direction `towards`, upright.
    pub fn from(towards: Vec3) -> View {
        let towards = towards.normalize();
        let right = Vec3::z().cross(&towards).normalize();
        View { axes: [right, towards.cross(&right), towards], middle: [0.0; 2], scale: 1.0 }
    }

    /// Lowest and highest place of triangles on the picture's axes [m].
    pub fn extent(&self, triangles: &[Triangle]) -> [[f64; 2]; 2] {
        let mut extent = [[f64::INFINITY; 2], [f64::NEG_INFINITY; 2]];
        for corner in triangles.iter().flat_map(|t| t.corners) {
            for k in 0..2 {
                let place = corner.dot(&self.axes[k]);
                extent[0][k] = extent[0][k].min(place);
                extent[1][k] = extent[1][k].max(place);
            }
        }
        extent
    }
}

/// What a pixel shows.
#[derive(Debug, Clone, Copy)]
struct Pixel {
    /// Towards the viewer [px]; minus infinity for nothing.
    depth: f64,
    triangle: u32,
    value: f64,
}

const NOTHING: Pixel = Pixel { depth: f64::NEG_INFINITY, triangle: u32::MAX, value: 0.0 };
/// Share of light that is everywhere.
const AMBIENT: f64 = 0.40;
/// Looks about each pixel for the shade.
const LOOKS: usize = 24;

/// The picture of triangles, `width` by `height` pixels. `colour` gives that of an owner with a value; `ink` is the
/// width of the lines between owners [px].
pub fn picture(
    triangles: &[Triangle],
    view: &View,
    [width, height]: [usize; 2],
    ink: usize,
    colour: &(impl Fn(i64, f64) -> Colour + Sync),
) -> Image {
    let mut pixels = vec![NOTHING; width * height];
    let mut normals = Vec::with_capacity(triangles.len());
    for (number, triangle) in triangles.iter().enumerate() {
        let seen = triangle.corners.map(|corner| {
            let on = |k: usize| corner.dot(&view.axes[k]) * view.scale;
            Vec3::new(
                on(0) - view.middle[0] * view.scale + 0.5 * width as f64,
                0.5 * height as f64 - on(1) + view.middle[1] * view.scale,
                on(2),
            )
        });
        // Upwards in space is downwards in rows.
        let normal = (seen[1] - seen[0]).cross(&(seen[2] - seen[0]));
        let normal = Vec3::new(-normal.x, normal.y, -normal.z);
        let length = normal.norm();
        // What is edge-on or turned away is not seen; plates are, from either side.
        let facing = if triangle.owner < 0 && normal.z < 0.0 { -normal } else { normal };
        normals.push(if length > 0.0 { facing / length } else { Vec3::z() });
        if facing.z > 1e-12 {
            fill(&mut pixels, [width, height], number as u32, &seen, &triangle.values);
        }
    }
    let lights: [(Vec3, f64); 2] =
        [(Vec3::new(-0.55, 0.65, 0.60).normalize(), 0.70), (Vec3::new(0.90, 0.15, 0.35).normalize(), 0.26)];
    let looks = looks(0.016 * height as f64);
    let shown = |x: isize, y: isize| -> Option<&Pixel> {
        let inside = x >= 0 && y >= 0 && x < width as isize && y < height as isize;
        inside.then(|| &pixels[y as usize * width + x as usize])
    };
    let owner = |pixel: &Pixel| triangles.get(pixel.triangle as usize).map(|t| (t.owner, t.cut));
    let reach = ink as isize / 2;
    let rows: Vec<Vec<u8>> = (0..height)
        .into_par_iter()
        .map(|y| {
            let mut row = Vec::with_capacity(3 * width);
            for x in 0..width {
                let pixel = &pixels[y * width + x];
                let Some(triangle) = triangles.get(pixel.triangle as usize) else {
                    row.extend([WHITE.0, WHITE.1, WHITE.2]);
                    continue;
                };
                let normal = &normals[pixel.triangle as usize];
                let mut light = if triangle.cut {
                    1.0
                } else {
                    let lit: f64 = lights.iter().map(|(l, strength)| strength * normal.dot(l).max(0.0)).sum();
                    let hidden = hidden(pixel, normal, [x, y], &looks, &shown);
                    (AMBIENT + lit) * (1.0 - 0.85 * hidden.powf(0.8))
                };
                let own = owner(pixel);
                let edge = |dx: isize, dy: isize| {
                    shown(x as isize + dx, y as isize + dy).is_some_and(|other| {
                        owner(other) != own && (other.depth < pixel.depth || triangle.cut)
                    })
                };
                let inked = reach > 0 && (-reach..=reach).any(|d| edge(d, 0) || edge(0, d));
                if inked {
                    light *= 0.42;
                }
                let Colour(r, g, b) = colour(triangle.owner, pixel.value);
                row.extend([r, g, b].map(|c| (f64::from(c) * light).round().clamp(0.0, 255.0) as u8));
            }
            row
        })
        .collect();
    Image { width, height, pixels: rows.concat() }
}

/// Enters a triangle where it is in front.
fn fill(pixels: &mut [Pixel], [width, height]: [usize; 2], number: u32, p: &[Vec3; 3], values: &[f64; 3]) {
    let area = (p[1].x - p[0].x) * (p[2].y - p[0].y) - (p[2].x - p[0].x) * (p[1].y - p[0].y);
    if area.abs() < 1e-9 || !p.iter().all(|c| c.iter().all(|x| x.is_finite())) {
        return;
    }
    let range = |axis: usize, size: usize| {
        let low = p.iter().map(|c| c[axis]).fold(f64::INFINITY, f64::min);
        let high = p.iter().map(|c| c[axis]).fold(f64::NEG_INFINITY, f64::max);
        (low - 0.5).floor().max(0.0) as usize..((high + 0.5).ceil().max(0.0) as usize).min(size)
    };
    for y in range(1, height) {
        for x in range(0, width) {
            let (cx, cy) = (x as f64 + 0.5, y as f64 + 0.5);
            let b = ((cx - p[0].x) * (p[2].y - p[0].y) - (cy - p[0].y) * (p[2].x - p[0].x)) / area;
            let c = ((p[1].x - p[0].x) * (cy - p[0].y) - (p[1].y - p[0].y) * (cx - p[0].x)) / area;
            let a = 1.0 - b - c;
            if a < 0.0 || b < 0.0 || c < 0.0 {
                continue;
            }
            let depth = a * p[0].z + b * p[1].z + c * p[2].z;
            let pixel = &mut pixels[y * width + x];
            if depth > pixel.depth {
                let value = a * values[0] + b * values[1] + c * values[2];
                *pixel = Pixel { depth, triangle: number, value };
            }
        }
    }
}

/// Where one looks about a pixel [px].
#[derive(Debug, Clone, Copy, Default)]
struct Look {
    right: isize,
    up: isize,
    reach: f64,
}

/// Looks up to `radius` [px]; the golden angle spreads any number of them evenly.
fn looks(radius: f64) -> [Look; LOOKS] {
    std::array::from_fn(|look| {
        let reach = radius * ((look + 1) as f64 / LOOKS as f64).powf(1.2);
        let angle = 2.399_963 * look as f64;
        let [right, up] = [angle.cos(), angle.sin()].map(|part| (reach * part).round() as isize);
        Look { right, up, reach }
    })
}

/// How much of the sky over a pixel its neighbours hide, 0 to 1: what stands out of the pixel's own plane.
fn hidden<'a>(
    pixel: &Pixel,
    normal: &Vec3,
    [x, y]: [usize; 2],
    looks: &[Look; LOOKS],
    shown: &impl Fn(isize, isize) -> Option<&'a Pixel>,
) -> f64 {
    let steep = normal.z.max(0.2);
    let mut sum = 0.0;
    let farthest = looks[LOOKS - 1].reach;
    for look in looks {
        let Some(there) = shown(x as isize + look.right, y as isize - look.up) else { continue };
        if there.depth == f64::NEG_INFINITY {
            continue;
        }
        let plane = pixel.depth - (normal.x * look.right as f64 + normal.y * look.up as f64) / steep;
        let above = there.depth - plane;
        // Distant things in front of a pixel do not darken it.
        if above < 3.0 * farthest {
            sum += (above / (0.5 * look.reach + 1.0)).clamp(0.0, 1.0);
        }
    }
    sum / LOOKS as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    fn triangle(z: f64, owner: i64, size: f64) -> Triangle {
        let corners = [[-size, -size, z], [size, -size, z], [0.0, size, z]].map(Vec3::from);
        Triangle { corners, values: [z; 3], owner, cut: true }
    }

    fn seen(triangles: &[Triangle]) -> Image {
        let axes = [Vec3::x(), Vec3::y(), Vec3::z()];
        let view = View { axes, middle: [0.0; 2], scale: 10.0 };
        picture(triangles, &view, [41, 41], 0, &|owner, _| Colour((10 * owner) as u8, 100, 0))
    }

    #[test]
    fn the_nearest_is_seen_whatever_the_order() {
        let (near, far) = (triangle(1.0, 3, 1.0), triangle(0.0, 5, 2.0));
        let one = seen(&[near, far]);
        assert_eq!(one, seen(&[far, near]));
        assert_eq!(one.at(20, 22), Colour(30, 100, 0));
        // Below the near one's edge the far one shows, and outside both nothing.
        assert_eq!(one.at(20, 35), Colour(50, 100, 0));
        assert_eq!(one.at(1, 1), WHITE);
    }

    #[test]
    fn what_is_turned_away_is_not_seen() {
        let mut away = triangle(0.0, 1, 1.0);
        away.corners.swap(0, 1);
        assert_eq!(seen(&[away]).at(20, 22), WHITE);
        away.owner = -1;
        assert_ne!(seen(&[away]).at(20, 22), WHITE);
    }

    #[test]
    fn up_is_up_and_right_is_right() {
        let view = View::from(Vec3::new(0.45, -1.0, 0.28));
        let [right, up, towards] = view.axes;
        assert!(up.z > 0.9 && right.x > 0.8 && towards.y < -0.8);
        assert!((right.cross(&up) - towards).norm() < 1e-12);
        // The upper corner of the triangle is in an upper row.
        let image = seen(&[triangle(0.0, 1, 1.5)]);
        let shown = |y: usize| (0..41).filter(|&x| image.at(x, y) != WHITE).count();
        assert!(shown(34) > shown(8) && shown(8) > 0);
    }
}
