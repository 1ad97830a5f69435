// The skin of a tube: a cylinder patch bent between the frames at the two ends of an interval.
// Hermite's cubic through both ends, the normal turned least between them, the radius likewise: a C¹ surface where sections are round.

struct Patch {
    @location(0) at: vec4f, // u along, turn around, its cosine and sine
    @location(1) place_a: vec4f,
    @location(2) slope_a: vec4f,
    @location(3) normal_a: vec4f,
    @location(4) arc_a: vec2f,
    @location(5) colour: vec4f,
    @location(6) tint: vec4f,
    @location(7) place_b: vec4f,
    @location(8) slope_b: vec4f,
    @location(9) normal_b: vec4f,
    @location(10) arc_b: vec2f,
    @location(11) flat_a: vec2f,
    @location(12) flat_b: vec2f,
    @builtin(instance_index) interval: u32,
}

struct Skin {
    @builtin(position) clip: vec4f,
    @location(0) p: vec3f,
    @location(1) n: vec3f,
    @location(2) t: vec3f,
    @location(3) uv: vec3f, // z: openness to the sky
    @location(4) @interpolate(flat) colour: vec3f,
    @location(5) @interpolate(flat) tint: vec4f,
    @location(6) @interpolate(flat) m: vec4f,
    @location(7) @interpolate(flat) k: vec4f,
}

struct Bent {
    p: vec3f,
    n: vec3f,
    t: vec3f,
}

fn bend(in: Patch) -> Bent {
    let u = in.at.x;
    let v = 1.0 - u;
    let h = max(in.arc_b.x - in.arc_a.x, 1e-9);
    let w = vec4f(v * v * (1.0 + 2.0 * u), u * u * (3.0 - 2.0 * u), u * v * v * h, -u * u * v * h);
    let d = vec4f(-6.0 * u * v / h, 6.0 * u * v / h, v * (1.0 - 3.0 * u), u * (3.0 * u - 2.0));
    // position and radius together: the radius is the fourth coordinate
    let place = in.place_a * w.x + in.place_b * w.y + in.slope_a * w.z + in.slope_b * w.w;
    let slope = in.place_a * d.x + in.place_b * d.y + in.slope_a * d.z + in.slope_b * d.w;
    let speed = max(length(slope.xyz), 1e-9);
    let t = slope.xyz / speed;
    let across = mix(in.normal_a.xyz, in.normal_b.xyz, u);
    let n = normalize(across - t * dot(across, t));
    let across_n = cross(t, n);
    let out = n * in.at.z + across_n * in.at.w;
    let side = across_n * in.at.z - n * in.at.w;
    // a section that is not round: its second harmonic, linear between both ends
    let twice = vec2f(in.at.z * in.at.z - in.at.w * in.at.w, 2.0 * in.at.z * in.at.w);
    let flattening = mix(in.flat_a, in.flat_b, u);
    let radius = max(place.w + dot(flattening, twice), 0.0);
    let widens = slope.w + dot(in.flat_b - in.flat_a, twice) / h;
    let turns = 2.0 * (flattening.y * twice.x - flattening.x * twice.y) / max(radius, 1e-9);
    var b: Bent;
    b.p = place.xyz + out * radius;
    b.n = normalize(out - t * (widens / speed) - side * turns);
    b.t = t;
    return b;
}

@vertex
fn vs_skin(in: Patch) -> Skin {
    return skin(in);
}

fn skin(in: Patch) -> Skin {
    let b = bend(in);
    let u = in.at.x;
    let twist = mix(in.normal_a.w, in.normal_b.w, u);
    var out: Skin;
    out.clip = clip(b.p);
    out.p = b.p;
    out.n = b.n;
    out.t = b.t;
    let along = mix(in.arc_a.x, in.arc_b.x, u) * in.arc_a.y;
    out.uv = vec3f(along, 2.0 * (in.at.y - twist * 0.15915494), openness(b.p, b.n));
    let material = 2u * u32(round(in.colour.a * 255.0));
    out.m = g.materials[material];
    out.k = g.materials[material + 1u];
    out.colour = linear(in.colour.rgb);
    let stripe = select(1.0, 0.62, g.viewport.z > 0.5 && (in.interval & 1u) == 1u);
    out.tint = vec4f(linear(in.tint.rgb) * stripe, in.tint.a);
    return out;
}

@vertex
fn vs_skin_shadow(in: Patch) -> @builtin(position) vec4f {
    let at = g.light_projection * vec4f(bend(in).p, 1.0);
    return vec4f(at.x * 2.0 - 1.0, 1.0 - at.y * 2.0, at.z, 1.0);
}

@fragment
fn fs_tissue(in: Skin) -> @location(0) vec4f {
    let n0 = normalize(in.n);
    let f = flesh(sampled(in.uv.xy), n0, in.t, in.colour, in.tint);
    let within = pool(in.p);
    let v = normalize(g.eye.xyz - in.p);
    let share = lit(shadow_place(in.p, n0)) * within;
    return finish(shade(Surface(f.n, v, f.albedo, in.m, in.k, f.gloss, in.uv.z), within, share));
}

// A tube of anything else: cable, wire.
@fragment
fn fs_skin(in: Skin) -> @location(0) vec4f {
    let n = normalize(in.n);
    let albedo = mix(in.colour, in.tint.rgb, in.tint.a);
    let within = pool(in.p);
    let v = normalize(g.eye.xyz - in.p);
    let share = lit(shadow_place(in.p, n)) * within;
    return finish(shade(Surface(n, v, albedo, in.m, in.k, 1.0, in.uv.z), within, share));
}

@fragment
fn fs_tissue_shadowed(in: Skin) -> @location(0) vec4f {
    let n0 = normalize(in.n);
    let f = flesh(sampled(in.uv.xy), n0, in.t, in.colour, in.tint);
    let within = pool(in.p);
    let v = normalize(g.eye.xyz - in.p);
    let share = lit_softly(shadow_place(in.p, n0)) * within;
    return finish(shade(Surface(f.n, v, f.albedo, in.m, in.k, f.gloss, openness(in.p, n0)), within, share));
}

@fragment
fn fs_skin_shadowed(in: Skin) -> @location(0) vec4f {
    let n = normalize(in.n);
    let albedo = mix(in.colour, in.tint.rgb, in.tint.a);
    let within = pool(in.p);
    let v = normalize(g.eye.xyz - in.p);
    let share = lit_softly(shadow_place(in.p, n)) * within;
    return finish(shade(Surface(n, v, albedo, in.m, in.k, 1.0, openness(in.p, n)), within, share));
}

// A skin lit at the corners of its triangles, in light and in shadow; a pixel chooses.
struct Lit {
    @builtin(position) clip: vec4f,
    @location(0) at: vec3f, // in the shadow map
    @location(1) light: vec3f,
    @location(2) dark: vec3f,
}

// A skin with one colour a triangle: that of its first corner.
struct Flat {
    @builtin(position) clip: vec4f,
    @location(0) @interpolate(flat) colour: vec3f,
}

// What its corners are made of; tissue without its texture has the texture's mean.
fn surface_of(s: Skin, material: f32) -> Surface {
    let v = normalize(g.eye.xyz - s.p);
    let own = s.colour * select(1.0, 0.925, material < 0.001);
    return Surface(s.n, v, mix(own, s.tint.rgb, s.tint.a), s.m, s.k, 1.0, s.uv.z);
}

@vertex
fn vs_skin_gouraud(in: Patch) -> Lit {
    let s = skin(in);
    let within = pool(s.p);
    var out: Lit;
    out.clip = s.clip;
    out.at = shadow_place(s.p, s.n);
    let surface = surface_of(s, in.colour.a);
    out.light = finish(shade(surface, within, within)).rgb;
    out.dark = finish(shade(surface, within, 0.0)).rgb;
    return out;
}

@fragment
fn fs_skin_gouraud(in: Lit) -> @location(0) vec4f {
    return vec4f(mix(in.dark, in.light, lit(in.at)), 1.0);
}

@vertex
fn vs_skin_flat(in: Patch) -> Flat {
    let s = skin(in);
    let within = pool(s.p);
    var out: Flat;
    out.clip = s.clip;
    let share = lit(shadow_place(s.p, s.n)) * within;
    out.colour = finish(shade(surface_of(s, in.colour.a), within, share)).rgb;
    return out;
}

@fragment
fn fs_skin_flat(in: Flat) -> @location(0) vec4f {
    return vec4f(in.colour, 1.0);
}

@fragment
fn fs_edge(in: Skin) -> @location(0) vec4f {
    return finish(mix(vec3f(0.85, 0.95, 1.0), in.tint.rgb * 2.2, in.tint.a * 0.7));
}

// The lean skin: what does not depend on its folds is worked out at the corners of its triangles.
struct Lean {
    @builtin(position) clip: vec4f,
    @location(0) at: vec3f, // in the shadow map
    @location(1) uv: vec2f,
    @location(2) @interpolate(linear) n: vec3f,
    @location(3) @interpolate(linear) t: vec3f,
    @location(4) @interpolate(linear) v: vec3f, // towards the eye
    @location(5) @interpolate(linear) air: vec2f, // within the pool, openness to the sky
    @location(6) @interpolate(flat) colour: vec3f,
    @location(7) @interpolate(flat) tint: vec4f,
    @location(8) @interpolate(flat) m: vec4f,
    @location(9) @interpolate(flat) k: vec4f,
}

@vertex
fn vs_skin_lean(in: Patch) -> Lean {
    let s = skin(in);
    var out: Lean;
    out.clip = s.clip;
    out.at = shadow_place(s.p, s.n);
    out.uv = s.uv.xy;
    out.n = s.n;
    out.t = s.t;
    out.v = normalize(g.eye.xyz - s.p);
    out.air = vec2f(pool(s.p), s.uv.z);
    out.colour = s.colour;
    out.tint = s.tint;
    out.m = s.m;
    out.k = s.k;
    return out;
}

@fragment
fn fs_tissue_lean(in: Lean) -> @location(0) vec4f {
    let f = flesh(sampled(in.uv), in.n, in.t, in.colour, in.tint);
    let s = Surface(f.n, in.v, f.albedo, in.m, in.k, f.gloss, in.air.y);
    return finish(shade(s, in.air.x, lit(in.at) * in.air.x));
}

@fragment
fn fs_skin_lean(in: Lean) -> @location(0) vec4f {
    let albedo = mix(in.colour, in.tint.rgb, in.tint.a);
    let s = Surface(normalize(in.n), in.v, albedo, in.m, in.k, 1.0, in.air.y);
    return finish(shade(s, in.air.x, lit(in.at) * in.air.x));
}
