// A solid with what is painted on it: light at every pixel, its colour from a texture. Follows solid.wgsl.

@group(1) @binding(0) var painting: texture_2d<f32>;
@group(1) @binding(1) var painting_sampler: sampler;

struct Place {
    @location(9) uv: vec2f,
    @location(10) wrap: vec2f, // x: repeats a metre of one that lies on sides, else 0
    @location(11) uv_to: vec2f,
}

struct Painted {
    @builtin(position) clip: vec4f,
    @location(0) at: vec3f, // in the shadow map
    @location(1) n: vec3f,
    @location(2) v: vec3f, // to the eye
    @location(3) own: vec3f, // in repeats
    @location(4) side: vec3f, // its normal in its own axes
    @location(5) uv: vec3f, // z: within the pool
    @location(6) @interpolate(flat) colour: vec4f, // a: whether the texture lies on sides
    @location(7) @interpolate(flat) tint: vec4f,
    @location(8) @interpolate(flat) m: vec4f,
    @location(9) @interpolate(flat) k: vec4f,
}

@vertex
fn vs_painted(in: Corner, place: Place) -> Painted {
    let s = solid(in);
    var out: Painted;
    out.clip = s.clip;
    out.at = shadow_place(s.p, s.n);
    out.n = s.n;
    out.v = g.eye.xyz - s.p;
    out.own = s.own * place.wrap.x;
    out.side = normal_of(in);
    out.uv = vec3f(mix(place.uv, place.uv_to, in.extents.w), pool(s.p));
    out.colour = vec4f(s.colour, f32(place.wrap.x > 0.0));
    out.tint = s.tint;
    out.m = s.m;
    out.k = s.k;
    return out;
}

// Straight onto a side: along the axis nearest to its normal, up staying up.
fn on_side(p: vec3f, side: vec3f) -> vec2f {
    let a = abs(side);
    let across = select(vec2f(p.x, -p.z), vec2f(p.y, -p.z), a.x >= a.y);
    return select(across, vec2f(p.x, -p.y), a.z > max(a.x, a.y));
}

// What is painted on it at a pixel, under its tint.
fn painted(in: Painted) -> vec3f {
    let place = select(in.uv.xy, on_side(in.own, in.side), in.colour.a > 0.5);
    let own = textureSample(painting, painting_sampler, place).rgb * in.colour.rgb;
    return mix(own, in.tint.rgb, in.tint.a);
}

@fragment
fn fs_painted(in: Painted) -> @location(0) vec4f {
    let within = in.uv.z;
    let s = Surface(normalize(in.n), normalize(in.v), painted(in), in.m, in.k, 1.0, 1.0);
    return finish(shade(s, within, lit(in.at) * within));
}

@fragment
fn fs_painted_shadowed(in: Painted) -> @location(0) vec4f {
    let within = in.uv.z;
    let n = normalize(in.n);
    let s = Surface(n, normalize(in.v), painted(in), in.m, in.k, 1.0, openness(g.eye.xyz - in.v, n));
    return finish(shade(s, within, lit_softly(in.at) * within));
}
