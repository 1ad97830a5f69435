//! Nearest points of segments and triangles, after (ERI05, ch. 5), made robust for parallel and degenerate ones.

use glam::DVec3;

/// Below this sine squared two segments count as parallel: 1e-4 of a radian, where an angle change of 1e-4 moves the crossing by a whole
/// length.
const PARALLEL_SINE2: f64 = 1e-8;

/// The fractions (s, t) of two segments at which they are nearest.
///
/// Where parallel segments overlap lengthwise, every pair of points is equally near: the middle of the overlap is taken, so that the result
/// does not jump from end to end.
pub fn near_segments([a0, a1]: [DVec3; 2], [b0, b1]: [DVec3; 2]) -> (f64, f64) {
    let (u, v, w) = (a1 - a0, b1 - b0, a0 - b0);
    let (uu, vv, uv) = (u.length_squared(), v.length_squared(), u.dot(v));
    let (uw, vw) = (u.dot(w), v.dot(w));
    let on_b = |s: f64| share(uv * s + vw, vv);
    let on_a = |t: f64| share(uv * t - uw, uu);
    let det = uu * vv - uv * uv;
    if det <= PARALLEL_SINE2 * uu * vv {
        let (from, to) = (share(-uw, uu), share(uv - uw, uu));
        let middle = 0.5 * (from + to);
        let t = on_b(middle);
        return (on_a(t), t);
    }
    let t = on_b(((uv * vw - uw * vv) / det).clamp(0.0, 1.0));
    let s = on_a(t);
    (s, on_b(s))
}

/// The fraction `top / bottom` of a segment, clamped to it; 0 for a segment without length.
fn share(top: f64, bottom: f64) -> f64 {
    if bottom > 0.0 { (top / bottom).clamp(0.0, 1.0) } else { 0.0 }
}

/// The point of a triangle nearest to `p`.
pub fn near_triangle(p: DVec3, [a, b, c]: [DVec3; 3]) -> DVec3 {
    let (ab, ac, ap) = (b - a, c - a, p - a);
    let (d1, d2) = (ab.dot(ap), ac.dot(ap));
    if d1 <= 0.0 && d2 <= 0.0 {
        return a;
    }
    let (d3, d4) = (ab.dot(p - b), ac.dot(p - b));
    if d3 >= 0.0 && d4 <= d3 {
        return b;
    }
    let vc = d1 * d4 - d3 * d2;
    if vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0 {
        return a + ab * share(d1, d1 - d3);
    }
    let (d5, d6) = (ab.dot(p - c), ac.dot(p - c));
    if d6 >= 0.0 && d5 <= d6 {
        return c;
    }
    let vb = d5 * d2 - d1 * d6;
    if vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0 {
        return a + ac * share(d2, d2 - d6);
    }
    let va = d3 * d6 - d5 * d4;
    if va <= 0.0 && d4 >= d3 && d5 >= d6 {
        return b + (c - b) * share(d4 - d3, (d4 - d3) + (d5 - d6));
    }
    let whole = va + vb + vc;
    a + ab * (vb / whole) + ac * (vc / whole)
}
