// What every shader shares: the frame's numbers, light, shadow, materials, tone.
// Positions are metres relative to the picture's origin, z up; colours are linear until `finish`.

struct Globals {
    view_projection: mat4x4f,
    light_projection: mat4x4f, // to shadow texture coordinates and depth
    eye: vec4f,                // w: shadow texel in metres
    light: vec4f,              // xyz: towards the light; w: one shadow texel in texture coordinates
    focus: vec4f,              // xyz: centre of what is lit, w: its radius
    viewport: vec4f,           // width, height, whether stripes show intervals, whether edges are drawn
    floor_point: vec4f,
    floor_normal: vec4f,
    floor_colour: vec4f,       // w: metres that the shadow's depth range spans
    materials: array<vec4f, 8>,
}

@group(0) @binding(0) var<uniform> g: Globals;
@group(0) @binding(1) var shadow_map: texture_depth_2d;
@group(0) @binding(2) var shadow_sampler: sampler_comparison;
@group(0) @binding(3) var tissue_map: texture_2d<f32>;
@group(0) @binding(4) var tissue_sampler: sampler;
// the same depths as plain numbers: OpenGL cannot both compare and read one binding
@group(0) @binding(5) var shadow_depths: texture_2d<f32>;

override ENCODE_SRGB: bool = false;
// lines lie on the triangles they outline: they come a little nearer
override NUDGE: f32 = 0.0;

const KEY = vec3f(3.1, 2.95, 2.7);
const SKY = vec3f(0.36, 0.42, 0.50);
const GROUND = vec3f(0.17, 0.12, 0.11);
const BOX = vec3f(3.4, 3.3, 3.15);

fn linear(c: vec3f) -> vec3f {
    return c * c * (c * 0.305306 + 0.682171) + c * 0.0125229;
}

fn clip(p: vec3f) -> vec4f {
    var c = g.view_projection * vec4f(p, 1.0);
    c.z += NUDGE * c.w * (c.z / c.w);
    return c;
}

// What lies behind everything: a dark room, lighter towards the top.
fn room(pixel: vec2f) -> vec3f {
    let y = pixel.y / g.viewport.y;
    let x = pixel.x / g.viewport.x - 0.5;
    return mix(vec3f(0.040, 0.052, 0.066), vec3f(0.010, 0.012, 0.016), saturate(y * 0.9 + x * x * 0.6));
}

// Share of the key light that reaches a point: four filtered comparisons.
fn lit(p: vec3f, n: vec3f) -> f32 {
    let at = g.light_projection * vec4f(p + n * (2.0 * g.eye.w), 1.0);
    let t = 1.1 * g.light.w;
    let z = min(at.z, 1.0);
    let a = textureSampleCompareLevel(shadow_map, shadow_sampler, at.xy + vec2f(-t, -0.4 * t), z);
    let b = textureSampleCompareLevel(shadow_map, shadow_sampler, at.xy + vec2f(0.4 * t, -t), z);
    let c = textureSampleCompareLevel(shadow_map, shadow_sampler, at.xy + vec2f(t, 0.4 * t), z);
    let d = textureSampleCompareLevel(shadow_map, shadow_sampler, at.xy + vec2f(-0.4 * t, t), z);
    return 0.25 * (a + b + c + d);
}

// How open a point is to the sky, from how far its surroundings rise above it towards the light.
fn openness(p: vec3f, n: vec3f) -> f32 {
    let reach = 0.075 * g.focus.w;
    let at = g.light_projection * vec4f(p + n * (0.35 * reach), 1.0);
    let size = 1.0 / g.light.w;
    let r = reach / g.eye.w; // in texels
    let c = at.xy * size;
    var shut = 0.0;
    let o = array<vec2f, 4>(vec2f(0.9, 0.35), vec2f(-0.35, 0.9), vec2f(-0.9, -0.35), vec2f(0.35, -0.9));
    for (var i = 0; i < 4; i++) {
        let d = textureLoad(shadow_depths, vec2i(clamp(c + o[i] * r, vec2f(0.0), vec2f(size - 1.0))), 0).r;
        shut += saturate((at.z - d) * g.floor_colour.w / reach * 0.6);
    }
    return 1.0 - 0.17 * shut;
}

// The light pool: full near the focus, fading outward.
fn pool(p: vec3f) -> f32 {
    let arm = p - g.focus.xyz;
    let off = arm - g.light.xyz * dot(arm, g.light.xyz);
    let d = dot(off, off) / (2.6 * g.focus.w * g.focus.w);
    return 1.0 / (1.0 + d * d);
}

// What a mirror would see: a room, and a soft rectangular lamp overhead.
fn reflected(r: vec3f) -> vec3f {
    let toward = max(dot(r, g.light.xyz), 1e-3);
    let x = abs(dot(r, vec3f(0.79, 0.61, 0.0))) / toward;
    let y = abs(dot(r, cross(g.light.xyz, vec3f(0.79, 0.61, 0.0)))) / toward;
    let lamp = (1.0 - smoothstep(0.20, 0.34, x)) * (1.0 - smoothstep(0.11, 0.22, y)) * step(0.0, r.z);
    return mix(GROUND * 0.6, SKY * 1.1, smoothstep(-0.5, 0.8, r.z)) + BOX * lamp;
}

struct Surface {
    p: vec3f,
    n: vec3f,
    geometric: vec3f,
    albedo: vec3f,
    material: u32,
    gloss: f32,
}

fn shade(s: Surface) -> vec3f {
    let m = g.materials[2u * s.material];      // wrap, reflectance, sharpness, sharp gain
    let k = g.materials[2u * s.material + 1u]; // broad sharpness, broad gain, mirror, metal
    let v = normalize(g.eye.xyz - s.p);
    let l = g.light.xyz;
    let nl = dot(s.n, l);
    let nv = saturate(dot(s.n, v));
    let share = lit(s.p, s.geometric) * pool(s.p);
    let open = openness(s.p, s.geometric);
    // light that went in here comes out a little further round, redder
    let wrapped = saturate((nl + m.x) / (1.0 + m.x));
    let bleed = vec3f(1.0, 0.42, 0.34) * (wrapped - saturate(nl));
    let key = KEY * share;
    let ambient = mix(GROUND, SKY, 0.5 + 0.5 * s.n.z) * open * (0.35 + 0.65 * pool(s.p));
    let diffuse = s.albedo * (1.0 - 0.85 * k.w) * (key * (saturate(nl) + bleed) * 0.62 + ambient);
    let h = normalize(l + v);
    let nh = saturate(dot(s.n, h));
    let edge = pow(1.0 - nv, 5.0);
    let f0 = mix(vec3f(m.y), s.albedo, k.w);
    let fresnel = f0 + (1.0 - f0) * edge * (0.25 + 0.75 * s.gloss);
    let sharp = m.w * pow(nh, m.z) * s.gloss;
    let broad = k.y * pow(nh, k.x);
    let glint = key * saturate(nl * 4.0) * f0 * (sharp + broad);
    let mirror = reflected(reflect(-v, s.n)) * fresnel * k.z * s.gloss * open * (0.3 + 0.7 * share + 0.25 * k.w);
    return diffuse + glint + mirror;
}

// Tone mapping (Narkowicz's fit of ACES) and, where the target does not do it, the sRGB curve.
fn finish(colour: vec3f) -> vec4f {
    let x = max(colour, vec3f(0.0)) * 0.82;
    var c = saturate((x * (2.51 * x + 0.03)) / (x * (2.43 * x + 0.59) + 0.14));
    if ENCODE_SRGB {
        c = select(1.055 * pow(c, vec3f(1.0 / 2.4)) - 0.055, c * 12.92, c <= vec3f(0.0031308));
    }
    return vec4f(c, 1.0);
}
