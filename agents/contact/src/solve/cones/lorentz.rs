//! Second-order (Lorentz) cones of up to four dimensions: their algebra, Nesterov and Todd's scaling, the way to their edge.
//!
//! In: points of such a cone. Out: products, scaled points, lengths of steps. Never here: laws of contact.
//! Theory: `docs/theory/clusters.md`, eq. C1 and C5. A half-line is the cone whose tails are zero.

use glam::DVec3;

/// The least determinant that is divided by: below it a point lies on the edge but for rounding.
const DET_MIN: f64 = 1e-300;

/// A point (x₀, x̄); of the cone where x₀ ≥ |x̄|, which is its own dual.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct Lorentz {
    /// x₀.
    pub head: f64,
    /// x̄.
    pub tail: DVec3,
}

/// The scaling of a pair of points of the cone, l and y: W with W l = W⁻¹ y = ν.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct Scaling {
    /// P = W² = t (2 w wᵀ − J), J = diag(1, −1, −1, −1).
    pub t: f64,
    pub w: Lorentz,
    /// W = β (2 v vᵀ − J).
    beta: f64,
    v: Lorentz,
    /// W l.
    nu: Lorentz,
}

impl Lorentz {
    pub const fn new(head: f64, tail: DVec3) -> Self {
        Self { head, tail }
    }

    pub fn plus(self, by: Self, share: f64) -> Self {
        Self::new(self.head + by.head * share, self.tail + by.tail * share)
    }

    fn times(self, by: f64) -> Self {
        Self::new(self.head * by, self.tail * by)
    }

    pub fn is_finite(self) -> bool {
        self.head.is_finite() && self.tail.is_finite()
    }

    pub fn dot(self, other: Self) -> f64 {
        self.head * other.head + self.tail.dot(other.tail)
    }

    /// J x.
    fn mirrored(self) -> Self {
        Self::new(self.head, -self.tail)
    }

    /// xᵀ J x.
    fn det(self) -> f64 {
        let tail = self.tail.length();
        (self.head - tail) * (self.head + tail)
    }

    /// x⁻¹ of the cone's product.
    pub fn inverse(self) -> Self {
        self.mirrored().times(1.0 / self.det().max(DET_MIN))
    }

    /// x ∘ y.
    fn product(self, other: Self) -> Self {
        Self::new(self.dot(other), other.tail * self.head + self.tail * other.head)
    }

    /// The y with x ∘ y = `product`.
    fn divide(self, product: Self) -> Self {
        let head = (self.head * product.head - self.tail.dot(product.tail)) / self.det().max(DET_MIN);
        Self::new(head, (product.tail - self.tail * head) / self.head)
    }

    /// How much of `step` leads to the edge of the cone; infinite where none does.
    pub fn reach(self, step: Self) -> f64 {
        let (a, b, c) = (step.det(), self.dot(step.mirrored()), self.det());
        let head = if step.head < 0.0 { -self.head / step.head } else { f64::INFINITY };
        // a α² + 2 b α + c = 0
        let discriminant = b * b - a * c;
        if discriminant < 0.0 {
            return head;
        }
        let q = if b >= 0.0 { -(b + discriminant.sqrt()) } else { discriminant.sqrt() - b };
        [q / a, c / q].into_iter().filter(|root| *root > 0.0).fold(head, f64::min)
    }
}

impl Scaling {
    /// The scaling of two points inside the cone.
    pub fn of(l: Lorentz, y: Lorentz) -> Self {
        let [of_l, of_y] = [l, y].map(|x| x.det().max(DET_MIN));
        let (unit_l, unit_y) = (l.times(of_l.sqrt().recip()), y.times(of_y.sqrt().recip()));
        let gamma = (0.5 * (1.0 + unit_l.dot(unit_y))).max(0.0).sqrt();
        let w = unit_y.plus(unit_l.mirrored(), 1.0).times(0.5 / gamma);
        let v = w.plus(Lorentz::new(1.0, DVec3::ZERO), 1.0).times((2.0 * (w.head + 1.0)).sqrt().recip());
        let t = (of_y / of_l).sqrt();
        let mut scaling = Self { t, w, beta: t.sqrt(), v, nu: Lorentz::default() };
        scaling.nu = scaling.scale(l);
        scaling
    }

    /// W x.
    pub fn scale(&self, x: Lorentz) -> Lorentz {
        self.v.times(2.0 * self.v.dot(x)).plus(x.mirrored(), -1.0).times(self.beta)
    }

    /// W⁻¹ x.
    fn unscale(&self, x: Lorentz) -> Lorentz {
        let v = self.v.mirrored();
        v.times(2.0 * v.dot(x)).plus(x.mirrored(), -1.0).times(self.beta.recip())
    }

    /// W (ν \ (W⁻¹ Δy ∘ W Δl)): the second-order term of both steps (C5).
    pub fn second_order(&self, dl: Lorentz, dy: Lorentz) -> Lorentz {
        self.scale(self.nu.divide(self.unscale(dy).product(self.scale(dl))))
    }
}
