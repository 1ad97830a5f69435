// The skin of a soft solid or sheet that is tissue: its texture is laid on from the three sides of the body at rest, and keeps to its matter.
// Follows solid.wgsl and tissue.wgsl; the end of a corner's geomorph is where the corner is at rest.

struct Hide {
    @builtin(position) clip: vec4f,
    @location(0) at: vec3f, // in the shadow map
    @location(1) n: vec3f,
    @location(2) v: vec3f, // to the eye
    @location(3) rest: vec3f, // in repeats of the texture
    @location(4) side: vec3f, // the normal at rest
    @location(5) within: f32,
    @location(6) @interpolate(flat) colour: vec3f,
    @location(7) @interpolate(flat) tint: vec4f,
    @location(8) @interpolate(flat) m: vec4f,
    @location(9) @interpolate(flat) k: vec4f,
}

struct Repeats {
    @location(10) wrap: vec2f, // x: repeats a metre
}

@vertex
fn vs_hide(in: Corner, repeats: Repeats) -> Hide {
    let s = solid(in);
    var out: Hide;
    out.clip = s.clip;
    out.at = shadow_place(s.p, s.n);
    out.n = s.n;
    out.v = g.eye.xyz - s.p;
    out.rest = in.core_to * repeats.wrap.x;
    out.side = in.normal_to;
    out.within = pool(s.p);
    out.colour = s.colour;
    out.tint = s.tint;
    out.m = s.m;
    out.k = s.k;
    return out;
}

// The three textures of a pixel, weighed by how far the body at rest faces each of its axes.
fn hide(in: Hide) -> Flesh {
    let squares = in.side * in.side;
    let powers = squares * squares;
    let w = powers / max(powers.x + powers.y + powers.z, 1e-9);
    let x = sampled(in.rest.yz);
    let y = sampled(in.rest.zx);
    let z = sampled(in.rest.xy);
    var out = coloured(x * w.x + y * w.y + z * w.z, normalize(in.n), in.colour, in.tint);
    // slopes of the folds in the axes at rest, from which a soft body turns little
    let slope = vec3f(0.0, x.ba - 0.5) * w.x + vec3f(y.a - 0.5, 0.0, y.b - 0.5) * w.y + vec3f(z.ba - 0.5, 0.0) * w.z;
    let across = slope - out.n * dot(slope, out.n);
    out.n = normalize(out.n - across * (HIDE_FOLDS * fold_share(in.tint)));
    return out;
}

// Organs are smoother than gut, for whose folds the texture was made.
const HIDE_FOLDS = 0.45;

@fragment
fn fs_hide(in: Hide) -> @location(0) vec4f {
    let f = hide(in);
    let s = Surface(f.n, normalize(in.v), f.albedo, in.m, in.k, f.gloss, 1.0);
    return finish(shade(s, in.within, lit(in.at) * in.within));
}

// Lean: the one texture of the axis that a pixel faces most, where its sides meet with a seam.
@fragment
fn fs_hide_lean(in: Hide) -> @location(0) vec4f {
    let a = abs(in.side);
    let x_most = a.x >= max(a.y, a.z);
    let z_most = !x_most && a.z >= a.y;
    let uv = select(select(in.rest.zx, in.rest.xy, z_most), in.rest.yz, x_most);
    let tissue = sampled(uv);
    let fold = tissue.ba - 0.5;
    let y_slope = vec3f(fold.y, 0.0, fold.x);
    let slope = select(select(y_slope, vec3f(fold, 0.0), z_most), vec3f(0.0, fold), x_most);
    var f = coloured(tissue, normalize(in.n), in.colour, in.tint);
    f.n = normalize(f.n - (slope - f.n * dot(slope, f.n)) * (HIDE_FOLDS * fold_share(in.tint)));
    let s = Surface(f.n, normalize(in.v), f.albedo, in.m, in.k, f.gloss, 1.0);
    return finish(shade(s, in.within, lit(in.at) * in.within));
}

@fragment
fn fs_hide_shadowed(in: Hide) -> @location(0) vec4f {
    let f = hide(in);
    let open = openness(g.eye.xyz - in.v, normalize(in.n));
    let s = Surface(f.n, normalize(in.v), f.albedo, in.m, in.k, f.gloss, open);
    return finish(shade(s, in.within, lit_softly(in.at) * in.within));
}
