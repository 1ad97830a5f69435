// Points and lines of foliage: triangles that turn to the eye, never thinner than a pixel. Follows solid.wgsl.

struct Stroke {
    @location(0) tip: vec4f, // where it begins; w: half the width of a line, a point's corners from its middle
    @location(1) way: vec4f, // to the end of a line, a point's normal; w: which corner, 0 … 2 of a point, 4 … 7 of a line
    @location(2) rotation: vec4f,
    @location(3) place: vec4f, // w: how many times larger points are
    @location(4) extents: vec4f,
    @location(5) colour: vec4f,
    @location(6) tint: vec4f,
}

struct Turned {
    p: vec3f,
    n: vec3f,
}

// The corner as seen from a direction; `toward` is the unit way to the eye, `least` the least half width.
fn facing(in: Stroke, a: vec3f, toward: vec3f, least: f32) -> Turned {
    let corner = u32(in.way.w);
    let size = max(in.tip.w * in.extents.x * max(in.place.w, 1.0), least);
    let way = turned(in.rotation, in.way.xyz);
    var out: Turned;
    if corner < 3u {
        let right = normalize(cross(vec3f(0.013, 0.021, 1.0), toward));
        let up = cross(toward, right);
        let angle = 2.0943951 * f32(corner);
        out.p = a + (right * cos(angle) + up * sin(angle)) * size;
        out.n = way;
        return out;
    }
    let across = normalize(cross(way, toward) + vec3f(1e-9, 0.0, 0.0));
    let side = select(1.0, -1.0, corner == 4u || corner == 7u);
    let end = select(0.0, in.extents.x, corner >= 6u);
    out.p = a + way * end + across * (side * size);
    let along = way / max(length(way), 1e-9);
    out.n = normalize(toward - along * dot(toward, along) + LIGHT * 0.3);
    return out;
}

fn begin(in: Stroke) -> vec3f {
    return turned(in.rotation, in.tip.xyz * in.extents.x) + in.place.xyz;
}

@vertex
fn vs_stroke(in: Stroke) -> Slab {
    let a = begin(in);
    let arm = g.eye.xyz - a;
    let away = max(length(arm), 1e-6);
    let s = facing(in, a, arm / away, 0.5 * away * g.viewport.w);
    let material = 2u * u32(round(in.colour.a * 255.0));
    let albedo = mix(linear(in.colour.rgb), linear(in.tint.rgb), in.tint.a);
    let within = pool(s.p);
    let surface = Surface(s.n, arm / away, albedo, g.materials[material], g.materials[material + 1u], 1.0, 1.0);
    var out: Slab;
    out.clip = clip(s.p);
    out.at = shadow_place(s.p, s.n);
    out.light = finish(shade(surface, within, within)).rgb;
    out.dark = finish(shade(surface, within, 0.0)).rgb;
    return out;
}

@vertex
fn vs_stroke_shadow(in: Stroke) -> @builtin(position) vec4f {
    let s = facing(in, begin(in), LIGHT, 0.0);
    let at = g.light_projection * vec4f(s.p, 1.0);
    return vec4f(at.x * 2.0 - 1.0, 1.0 - at.y * 2.0, at.z, 1.0);
}
