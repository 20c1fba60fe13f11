//! Forward-mode derivatives: a number that carries its gradient with respect to `N` variables.
//!
//! Contact forces are written once over [`Real`]; with [`Dual`] the same lines give their exact
//! tangent, so that a force and its derivative cannot drift apart.

use std::ops::{Add, Div, Mul, Neg, Sub};

/// What a formula needs of a number: `f64`, or an `f64` with derivatives.
pub trait Real:
    Copy + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> + Div<Output = Self> + Neg<Output = Self>
{
    fn constant(value: f64) -> Self;
    /// The value without its derivatives; decisions (branches, clamps) are made on it.
    fn value(self) -> f64;
    fn sqrt(self) -> Self;
    fn scaled(self, factor: f64) -> Self;
}

impl Real for f64 {
    fn constant(value: f64) -> Self {
        value
    }
    fn value(self) -> f64 {
        self
    }
    fn sqrt(self) -> Self {
        f64::sqrt(self)
    }
    fn scaled(self, factor: f64) -> Self {
        self * factor
    }
}

/// A value and its gradient.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Dual<const N: usize> {
    pub value: f64,
    pub gradient: [f64; N],
}

impl<const N: usize> Dual<N> {
    /// The `index`-th variable, at `value`.
    pub fn variable(value: f64, index: usize) -> Self {
        let mut gradient = [0.0; N];
        gradient[index] = 1.0;
        Dual { value, gradient }
    }

    fn chain(self, value: f64, slope: f64) -> Self {
        Dual { value, gradient: self.gradient.map(|g| g * slope) }
    }

    fn combine(self, other: Self, value: f64, by_self: f64, by_other: f64) -> Self {
        let mut gradient = [0.0; N];
        for (k, g) in gradient.iter_mut().enumerate() {
            *g = self.gradient[k] * by_self + other.gradient[k] * by_other;
        }
        Dual { value, gradient }
    }
}

impl<const N: usize> Add for Dual<N> {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        self.combine(other, self.value + other.value, 1.0, 1.0)
    }
}

impl<const N: usize> Sub for Dual<N> {
    type Output = Self;
    fn sub(self, other: Self) -> Self {
        self.combine(other, self.value - other.value, 1.0, -1.0)
    }
}

impl<const N: usize> Mul for Dual<N> {
    type Output = Self;
    fn mul(self, other: Self) -> Self {
        self.combine(other, self.value * other.value, other.value, self.value)
    }
}

impl<const N: usize> Div for Dual<N> {
    type Output = Self;
    fn div(self, other: Self) -> Self {
        let quotient = self.value / other.value;
        self.combine(other, quotient, 1.0 / other.value, -quotient / other.value)
    }
}

impl<const N: usize> Neg for Dual<N> {
    type Output = Self;
    fn neg(self) -> Self {
        self.chain(-self.value, -1.0)
    }
}

impl<const N: usize> Real for Dual<N> {
    fn constant(value: f64) -> Self {
        Dual { value, gradient: [0.0; N] }
    }
    fn value(self) -> f64 {
        self.value
    }
    fn sqrt(self) -> Self {
        let root = self.value.sqrt();
        self.chain(root, 0.5 / root)
    }
    fn scaled(self, factor: f64) -> Self {
        self.chain(self.value * factor, factor)
    }
}

/// A 3-vector over [`Real`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Vector<T>(pub [T; 3]);

impl<T: Real> Vector<T> {
    pub fn constant(v: &super::Vec3) -> Self {
        Vector([T::constant(v.x), T::constant(v.y), T::constant(v.z)])
    }
    pub fn zero() -> Self {
        Vector([T::constant(0.0); 3])
    }
    pub fn value(&self) -> super::Vec3 {
        super::Vec3::new(self.0[0].value(), self.0[1].value(), self.0[2].value())
    }
    pub fn dot(self, other: Self) -> T {
        self.0[0] * other.0[0] + self.0[1] * other.0[1] + self.0[2] * other.0[2]
    }
    pub fn cross(self, other: Self) -> Self {
        let ([a, b, c], [x, y, z]) = (self.0, other.0);
        Vector([b * z - c * y, c * x - a * z, a * y - b * x])
    }
    pub fn times(self, factor: T) -> Self {
        Vector(self.0.map(|x| x * factor))
    }
    pub fn norm(self) -> T {
        self.dot(self).sqrt()
    }
    /// `matrix * self` for a constant matrix.
    pub fn turned_by(self, matrix: &super::Mat3) -> Self {
        let row = |i: usize| {
            self.0[0].scaled(matrix[(i, 0)])
                + self.0[1].scaled(matrix[(i, 1)])
                + self.0[2].scaled(matrix[(i, 2)])
        };
        Vector([row(0), row(1), row(2)])
    }
}

impl<T: Real> Add for Vector<T> {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        Vector([self.0[0] + other.0[0], self.0[1] + other.0[1], self.0[2] + other.0[2]])
    }
}

impl<T: Real> Sub for Vector<T> {
    type Output = Self;
    fn sub(self, other: Self) -> Self {
        Vector([self.0[0] - other.0[0], self.0[1] - other.0[1], self.0[2] - other.0[2]])
    }
}

impl<T: Real> Neg for Vector<T> {
    type Output = Self;
    fn neg(self) -> Self {
        Vector(self.0.map(|x| -x))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sample<T: Real>(x: T, y: T) -> T {
        (x * y + x / y).sqrt() - (y.scaled(3.0) - x) * x
    }

    #[test]
    fn gradient_is_derivative_of_value() {
        let (x, y, h) = (1.3, 0.7, 1e-6);
        let dual = sample(Dual::<2>::variable(x, 0), Dual::variable(y, 1));
        let by_x = (sample(x + h, y) - sample(x - h, y)) / (2.0 * h);
        let by_y = (sample(x, y + h) - sample(x, y - h)) / (2.0 * h);
        assert!((dual.value - sample(x, y)).abs() < 1e-15);
        assert!((dual.gradient[0] - by_x).abs() < 1e-8, "{} {by_x}", dual.gradient[0]);
        assert!((dual.gradient[1] - by_y).abs() < 1e-8, "{} {by_y}", dual.gradient[1]);
    }
}
