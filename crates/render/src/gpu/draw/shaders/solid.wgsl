// Solids: a core swept by a ball, turned and moved, one instance each.

struct Corner {
    @location(0) core: vec3f,
    @location(1) normal: vec3f,
    @location(2) rotation: vec4f,
    @location(3) place: vec4f,
    @location(4) extents: vec4f,
    @location(5) colour: vec4f,
    @location(6) tint: vec4f,
    @location(7) core_to: vec3f, // where it is at the end of its way, of which extents.w is behind it
    @location(8) normal_to: vec3f,
}

struct Solid {
    @builtin(position) clip: vec4f,
    @location(0) p: vec3f,
    @location(1) n: vec3f,
    @location(2) own: vec3f,
    @location(3) @interpolate(flat) colour: vec3f,
    @location(4) @interpolate(flat) tint: vec4f,
    @location(5) @interpolate(flat) m: vec4f,
    @location(6) @interpolate(flat) k: vec4f,
}

fn turned(q: vec4f, v: vec3f) -> vec3f {
    return v + 2.0 * cross(q.xyz, cross(q.xyz, v) + q.w * v);
}

@vertex
fn vs_solid(in: Corner) -> Solid {
    return solid(in);
}

// Its normal, on its way.
fn normal_of(in: Corner) -> vec3f {
    let n = mix(in.normal, in.normal_to, in.extents.w);
    // a corner at rest keeps its bits
    return select(n, n * inverseSqrt(max(dot(n, n), 1e-9)), in.extents.w > 0.0);
}

fn own_of(in: Corner, n: vec3f) -> vec3f {
    return mix(in.core, in.core_to, in.extents.w) * in.extents.xyz + n * in.place.w;
}

fn solid(in: Corner) -> Solid {
    let n = normal_of(in);
    let own = own_of(in, n);
    var out: Solid;
    out.p = turned(in.rotation, own) + in.place.xyz;
    out.n = turned(in.rotation, n);
    out.clip = clip(out.p);
    out.own = own;
    let material = 2u * u32(round(in.colour.a * 255.0));
    out.m = g.materials[material];
    out.k = g.materials[material + 1u];
    out.colour = linear(in.colour.rgb);
    out.tint = vec4f(linear(in.tint.rgb), in.tint.a);
    return out;
}

@vertex
fn vs_solid_shadow(in: Corner) -> @builtin(position) vec4f {
    let own = own_of(in, normal_of(in));
    let at = g.light_projection * vec4f(turned(in.rotation, own) + in.place.xyz, 1.0);
    return vec4f(at.x * 2.0 - 1.0, 1.0 - at.y * 2.0, at.z, 1.0);
}

// Brushed around the axis: fine grooves scatter light along it, as long as they are wider than pixels.
fn brushed(n: vec3f, own: vec3f, metal: f32) -> vec3f {
    let groove = abs(fract(own.z * 1400.0) - 0.5) + abs(fract(own.z * 590.0 + own.x * 140.0) - 0.5) - 0.5;
    let fade = saturate(1.0 - 2600.0 * abs(dpdx(own.z)) - 2600.0 * abs(dpdy(own.z)));
    return normalize(n + vec3f(0.06, -0.04, 0.10) * (groove * metal * fade));
}

@fragment
fn fs_solid(in: Solid) -> @location(0) vec4f {
    let n0 = normalize(in.n);
    let albedo = mix(in.colour, in.tint.rgb, in.tint.a);
    let within = pool(in.p);
    let v = normalize(g.eye.xyz - in.p);
    let share = lit(shadow_place(in.p, n0)) * within;
    return finish(shade(Surface(brushed(n0, in.own, in.k.w), v, albedo, in.m, in.k, 1.0, 1.0), within, share));
}

@fragment
fn fs_solid_shadowed(in: Solid) -> @location(0) vec4f {
    let n0 = normalize(in.n);
    let albedo = mix(in.colour, in.tint.rgb, in.tint.a);
    let within = pool(in.p);
    let v = normalize(g.eye.xyz - in.p);
    let share = lit_softly(shadow_place(in.p, n0)) * within;
    let s = Surface(brushed(n0, in.own, in.k.w), v, albedo, in.m, in.k, 1.0, openness(in.p, n0));
    return finish(shade(s, within, share));
}

// A solid, lean: the pool of light and the place in the shadow map come from its corners.
struct Lean {
    @builtin(position) clip: vec4f,
    @location(0) at: vec3f, // in the shadow map
    @location(1) n: vec3f,
    @location(2) v: vec3f, // to the eye
    @location(3) own: vec3f,
    @location(4) within: f32,
    @location(5) @interpolate(flat) albedo: vec3f,
    @location(6) @interpolate(flat) m: vec4f,
    @location(7) @interpolate(flat) k: vec4f,
}

@vertex
fn vs_solid_lean(in: Corner) -> Lean {
    let s = solid(in);
    var out: Lean;
    out.clip = s.clip;
    out.at = shadow_place(s.p, s.n);
    out.n = s.n;
    out.v = g.eye.xyz - s.p;
    out.own = s.own;
    out.within = pool(s.p);
    out.albedo = mix(s.colour, s.tint.rgb, s.tint.a);
    out.m = s.m;
    out.k = s.k;
    return out;
}

@fragment
fn fs_solid_lean(in: Lean) -> @location(0) vec4f {
    let n = brushed(normalize(in.n), in.own, in.k.w);
    let s = Surface(n, normalize(in.v), in.albedo, in.m, in.k, 1.0, 1.0);
    return finish(shade(s, in.within, lit(in.at) * in.within));
}

// A fixed box, lean: its cells are lit at their corners, in light and in shadow, and a pixel chooses.
struct Slab {
    @builtin(position) clip: vec4f,
    @location(0) at: vec3f, // in the shadow map
    @location(1) light: vec3f,
    @location(2) dark: vec3f,
}

@vertex
fn vs_slab(in: Corner) -> Slab {
    let s = solid(in);
    let within = pool(s.p);
    let v = normalize(g.eye.xyz - s.p);
    let surface = Surface(s.n, v, mix(s.colour, s.tint.rgb, s.tint.a), s.m, s.k, 1.0, 1.0);
    var out: Slab;
    out.clip = s.clip;
    out.at = shadow_place(s.p, s.n);
    out.light = finish(shade(surface, within, within)).rgb;
    out.dark = finish(shade(surface, within, 0.0)).rgb;
    return out;
}

@fragment
fn fs_slab(in: Slab) -> @location(0) vec4f {
    return vec4f(mix(in.dark, in.light, lit(in.at)), 1.0);
}

// A solid with one colour a triangle: that of its first corner.
struct Flat {
    @builtin(position) clip: vec4f,
    @location(0) @interpolate(flat) colour: vec3f,
}

@vertex
fn vs_flat(in: Corner) -> Flat {
    let s = solid(in);
    let within = pool(s.p);
    let v = normalize(g.eye.xyz - s.p);
    let surface = Surface(s.n, v, mix(s.colour, s.tint.rgb, s.tint.a), s.m, s.k, 1.0, 1.0);
    var out: Flat;
    out.clip = s.clip;
    out.colour = finish(shade(surface, within, lit(shadow_place(s.p, s.n)) * within)).rgb;
    return out;
}

@fragment
fn fs_flat(in: Flat) -> @location(0) vec4f {
    return vec4f(in.colour, 1.0);
}

@fragment
fn fs_solid_edge(in: Solid) -> @location(0) vec4f {
    return finish(mix(vec3f(0.55, 0.62, 0.68), in.tint.rgb * 2.2, in.tint.a * 0.7));
}
