// Pieces of foliage that turn to the eye: points, lines and leaves. Follows solid.wgsl.

struct Stroke {
    @location(0) tip: vec4f, // where it begins; w: half the width of a line, radius of a disc that covers what a leaf does on average
    @location(1) way: vec4f, // to the end of a line, a leaf's normal; w: corner, 0 … 2 of a point, 4 … 7 of a line, 8 … 11 of a leaf
    @location(2) rotation: vec4f,
    @location(3) place: vec4f, // w: factor on the size of points
    @location(4) extents: vec4f,
    @location(5) colour: vec4f,
    @location(6) tint: vec4f,
}

struct Turned {
    p: vec3f,
    n: vec3f,
    spot: vec2f, // of a point, in its radii
    lift: vec3f, // what a point is not shaded by: itself
}

// Largest radius of a point, pixels (RH05, §7.2).
const POINT_MAX: f32 = 10.0;
// Half the length of a leaf over its disc's radius; it is half as wide.
const LEAF_LENGTH: f32 = 2.5066283;

// The corner as seen from a direction; `toward` is the unit way to the eye, `pixel` the size of one at the corner, 0 for no limits.
fn facing(in: Stroke, a: vec3f, toward: vec3f, pixel: f32) -> Turned {
    let corner = u32(in.way.w);
    let way = turned(in.rotation, in.way.xyz);
    let radius = in.tip.w * in.extents.x;
    var out: Turned;
    out.n = way;
    out.spot = vec2f(0.0);
    out.lift = vec3f(0.0);
    if corner < 4u {
        // a triangle around the disc, of which the fragments past the disc are left out
        let most = select(1e9, POINT_MAX * pixel, pixel > 0.0);
        let size = clamp(radius * in.place.w, 0.5 * pixel, most);
        let right = normalize(cross(vec3f(0.013, 0.021, 1.0), toward));
        let up = cross(toward, right);
        let angle = 2.0943951 * f32(corner);
        // a shadow has no fragments to leave out: its triangle is as large as the disc
        out.spot = select(1.5551, 2.0, pixel > 0.0) * vec2f(cos(angle), sin(angle));
        out.p = a + (right * out.spot.x + up * out.spot.y) * size;
        out.lift = a + LIGHT * size - out.p;
        return out;
    }
    if corner >= 8u {
        // seen from behind it is its mirror image, so that both sides are drawn
        let k = corner - 8u;
        let side = select(-1.0, 1.0, dot(way, toward) >= 0.0);
        let x = normalize(cross(select(vec3f(0.0, 0.0, 1.0), vec3f(1.0, 0.0, 0.0), abs(way.z) > 0.9), way)) * side;
        let y = cross(way, x) * side;
        let across = select(0.0, 0.5, k == 1u) - select(0.0, 0.5, k == 3u);
        let along = select(0.0, 1.0, k == 2u) - select(0.0, 1.0, k == 0u);
        out.p = a + (x * across + y * along) * (LEAF_LENGTH * radius);
        return out;
    }
    let across = normalize(cross(way, toward) + vec3f(1e-9, 0.0, 0.0));
    let side = select(1.0, -1.0, corner == 4u || corner == 7u);
    let end = select(0.0, in.extents.x, corner >= 6u);
    out.p = a + way * end + across * (side * max(radius, 0.5 * pixel));
    // the sides of a round bough look away to the sides
    out.n = normalize(toward + across * side);
    return out;
}

fn begin(in: Stroke) -> vec3f {
    return turned(in.rotation, in.tip.xyz * in.extents.x) + in.place.xyz;
}

struct Lit {
    @builtin(position) clip: vec4f,
    @location(0) at: vec3f, // in the shadow map
    @location(1) light: vec3f,
    @location(2) dark: vec3f,
    @location(3) spot: vec2f,
}

@vertex
fn vs_stroke(in: Stroke) -> Lit {
    let a = begin(in);
    let arm = g.eye.xyz - a;
    let away = max(length(arm), 1e-6);
    let s = facing(in, a, arm / away, away * g.viewport.w);
    let material = 2u * u32(round(in.colour.a * 255.0));
    let albedo = mix(linear(in.colour.rgb), linear(in.tint.rgb), in.tint.a);
    let within = pool(s.p);
    let surface = Surface(s.n, arm / away, albedo, g.materials[material], g.materials[material + 1u], 1.0, 1.0);
    var out: Lit;
    out.clip = clip(s.p);
    out.at = shadow_place(s.p + s.lift, s.n);
    out.light = finish(shade(surface, within, within)).rgb;
    out.dark = finish(shade(surface, within, 0.0)).rgb;
    out.spot = s.spot;
    return out;
}

@fragment
fn fs_stroke(in: Lit) -> @location(0) vec4f {
    if dot(in.spot, in.spot) > 1.0 {
        discard;
    }
    return vec4f(mix(in.dark, in.light, lit(in.at)), 1.0);
}

@vertex
fn vs_stroke_shadow(in: Stroke) -> @builtin(position) vec4f {
    let s = facing(in, begin(in), LIGHT, 0.0);
    let at = g.light_projection * vec4f(s.p, 1.0);
    return vec4f(at.x * 2.0 - 1.0, 1.0 - at.y * 2.0, at.z, 1.0);
}
