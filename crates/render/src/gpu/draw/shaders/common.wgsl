// What every shader shares: the frame's numbers, light, shadow, materials, tone.
// Positions are metres relative to the picture's origin, z up; colours are linear until `finish`.
// Written before this text, by the environment: LIGHT (towards the key light), LAMP_X and LAMP_Y (its lamp's sides), its strength KEY, what
// surfaces facing up and down receive from all around (SKY, GROUND), the lamp as a mirror shows it (LAMP), FAR_SHARE, AT_CAMERA, FADES.
// Lean fragments read no uniforms: Mesa's llvmpipe spends as long on one as on ten additions.

struct Globals {
    view_projection: mat4x4f,
    light_projection: mat4x4f, // to shadow texture coordinates and depth
    eye: vec4f,                // w: shadow texel in metres
    texel: vec4f,              // x: one shadow texel in texture coordinates, y: metres from the eye to what it looks at
    focus: vec4f,              // xyz: centre of what is lit, w: its radius
    viewport: vec4f,           // width, height, whether stripes show intervals, metres a pixel one metre away
    floor_point: vec4f,
    floor_normal: vec4f,
    floor_colour: vec4f,       // w: metres that the shadow's depth range spans
    patch_centre: vec4f,       // the part of the floor under the shadow map; w: how many times larger all of the floor is
    patch_x: vec4f,            // its sides
    patch_y: vec4f,
    view_forward: vec4f,       // the direction of view, and half the picture's width and height one metre away
    view_right: vec4f,
    view_up: vec4f,
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
// comparisons of a soft shadow: one where a processor draws, four elsewhere
override SHADOW_TAPS: i32 = 1;
// lines lie on the triangles they outline: they come a little nearer
override NUDGE: f32 = 0.0;

fn linear(c: vec3f) -> vec3f {
    return c * c * (c * 0.305306 + 0.682171) + c * 0.0125229;
}

fn clip(p: vec3f) -> vec4f {
    var c = g.view_projection * vec4f(p, 1.0);
    c.z += NUDGE * c.w * (c.z / c.w);
    return c;
}

// What lies behind everything in a direction of view: what SKY and GROUND are the integrals of (environment.rs).
fn background(direction: vec3f) -> vec3f {
    return 0.5 * (SKY + GROUND) + (SKY - GROUND) * (0.75 * normalize(direction).z);
}

// What a surface receives from all around: `within` the pool of the key light.
fn ambient(n: vec3f, within: f32) -> vec3f {
    return mix(GROUND, SKY, 0.5 + 0.5 * n.z) * mix(FAR_SHARE, 1.0, within);
}

// Where a point of a surface is in the shadow map, a little off the surface.
fn shadow_place(p: vec3f, n: vec3f) -> vec3f {
    return (g.light_projection * vec4f(p + n * (2.0 * g.eye.w), 1.0)).xyz;
}

// Share of the key light that reaches a place in the shadow map: filtered comparisons around it.
fn lit(at: vec3f) -> f32 {
    if AT_CAMERA {
        return 1.0;
    }
    let z = min(at.z, 1.0);
    if SHADOW_TAPS == 1 {
        return textureSampleCompareLevel(shadow_map, shadow_sampler, at.xy, z);
    }
    var o = vec2f(1.2, 0.5) * g.texel.x;
    var sum = 0.0;
    for (var i = 0; i < SHADOW_TAPS; i++) {
        sum += textureSampleCompareLevel(shadow_map, shadow_sampler, at.xy + o, z);
        o = vec2f(-o.y, o.x);
    }
    return sum / f32(SHADOW_TAPS);
}

// The same with a soft rim: three rings of four comparisons, each turned a little from the one within.
fn lit_softly(at: vec3f) -> f32 {
    if AT_CAMERA {
        return 1.0;
    }
    let z = min(at.z, 1.0);
    var o = vec2f(0.9, 0.3) * g.texel.x;
    var sum = 0.0;
    for (var i = 0; i < 12; i++) {
        sum += textureSampleCompareLevel(shadow_map, shadow_sampler, at.xy + o, z);
        o = vec2f(-o.y, o.x);
        if i % 4 == 3 {
            o = vec2f(o.x * 1.55 - o.y * 0.9, o.x * 0.9 + o.y * 1.55);
        }
    }
    return sum / 12.0;
}

// How open a point is to the sky, from how far its surroundings rise above its tangent plane towards the light.
fn openness(p: vec3f, n: vec3f) -> f32 {
    if AT_CAMERA {
        return 1.0;
    }
    let reach = 0.075 * g.focus.w;
    let at = g.light_projection * vec4f(p + n * (0.35 * reach), 1.0);
    let size = 1.0 / g.texel.x;
    let o = vec2f(0.9, 0.35) * (reach / g.eye.w);
    let across = vec2f(-o.y, o.x);
    let c = at.xy * size;
    // how the depth of the tangent plane changes by texel: steeper than 1 in 7 it is no longer followed
    let m = g.light_projection;
    let n_map = vec2f(dot(vec3f(m[0].x, m[1].x, m[2].x), n), dot(vec3f(m[0].y, m[1].y, m[2].y), n));
    let fall = n_map * (g.eye.w * g.eye.w * size / (g.floor_colour.w * max(dot(n, LIGHT), 0.15)));
    let low = rise(c + o, at.z + dot(fall, o)) + rise(c - o, at.z - dot(fall, o));
    let high = rise(c + across, at.z + dot(fall, across)) + rise(c - across, at.z - dot(fall, across));
    return 1.0 - 0.17 * (low + high);
}

// How far what lies at a texel stands above a depth, in shares of the reach of `openness`.
fn rise(texel: vec2f, depth: f32) -> f32 {
    let d = textureLoad(shadow_depths, vec2i(clamp(texel, vec2f(0.0), vec2f(1.0 / g.texel.x - 1.0))), 0).r;
    return saturate((depth - d) * g.floor_colour.w / g.focus.w * 8.0);
}

// The light pool: full near the focus, fading outward; of a light at the camera full on the axis of view at what it looks at.
fn pool(p: vec3f) -> f32 {
    if AT_CAMERA {
        let arm = p - g.eye.xyz;
        let away = max(dot(arm, arm), 1e-12);
        let along = dot(arm, g.view_forward.xyz);
        let fall = min(g.texel.y * g.texel.y / away, 2.0);
        return fall * smoothstep(0.40, 0.98, along * along / away);
    }
    if !FADES {
        return 1.0;
    }
    let arm = p - g.focus.xyz;
    let off = arm - LIGHT * dot(arm, LIGHT);
    let d = dot(off, off) / (1.5 * g.focus.w * g.focus.w);
    return 1.0 / (1.0 + d * d);
}

// What a mirror would see: a room, and a soft rectangular lamp overhead.
fn reflected(r: vec3f) -> vec3f {
    let toward = max(dot(r, LIGHT), 1e-3);
    let off = abs(vec2f(dot(r, LAMP_X), dot(r, LAMP_Y))) / toward;
    let inside = saturate((vec2f(0.34, 0.22) - off) * vec2f(7.0, 9.0));
    let soft = inside * inside * (3.0 - 2.0 * inside);
    // dark below, a bright band above the horizon, dimmer overhead
    let band = saturate(r.z * 3.0 + 0.3) * (1.3 - r.z);
    return mix(GROUND * 0.5, SKY * 2.2, band) + LAMP * (soft.x * soft.y * step(0.0, r.z));
}

struct Surface {
    n: vec3f,
    v: vec3f, // towards the eye
    albedo: vec3f,
    m: vec4f, // wrap, reflectance, sharp width, sharp gain
    k: vec4f, // broad width, broad gain, mirror, metal
    gloss: f32,
    open: f32,
}

// The light that leaves a surface towards the eye: `within` the pool, under a share of the key light.
fn shade(s: Surface, within: f32, share: f32) -> vec3f {
    let m = s.m;
    let k = s.k;
    let toward = select(LIGHT, s.v, AT_CAMERA);
    let nl = dot(s.n, toward);
    let nv = saturate(dot(s.n, s.v));
    let vl = dot(s.v, toward);
    // light that went in here comes out a little further round, redder
    let faced = saturate(nl);
    let bleed = vec3f(1.0, 0.42, 0.34) * (saturate((nl + m.x) / (1.0 + m.x)) - faced);
    let key = KEY * share;
    let around = ambient(s.n, within) * s.open;
    let diffuse = s.albedo * (1.0 - 0.85 * k.w) * (key * (faced + bleed) * 0.42 + around);
    // two lobes of Trowbridge and Reitz about half way between eye and light, each 1 at its peak times its gain
    let half = max(nl + nv, 0.0);
    let nh2 = min(half * half * 0.5 / max(1.0 + vl, 1e-3), 1.0);
    let lobes = vec2f(m.z, k.x) / (1.0 + nh2 * (vec2f(m.z, k.x) - 1.0));
    let glint = dot(lobes * lobes, vec2f(m.w * s.gloss, k.y)) * saturate(nl * 4.0);
    let rim = (1.0 - nv) * (1.0 - nv);
    let edge = rim * rim * (1.0 - nv);
    let f0 = mix(vec3f(m.y), s.albedo, k.w);
    let fresnel = f0 + (1.0 - f0) * (edge * (0.25 + 0.75 * s.gloss));
    let mirror = reflected(s.n * (2.0 * nv) - s.v) * fresnel;
    return diffuse + key * f0 * glint + mirror * (k.z * s.gloss * s.open * (0.3 + 0.7 * share + 0.25 * k.w));
}

// Tone mapping by Hejl's and Burgess-Dawson's curve, which ends in sRGB values; taken back where the target makes them.
fn finish(colour: vec3f) -> vec4f {
    let x = max(colour * 0.92 - 0.004, vec3f(0.0));
    let c = (x * (6.2 * x + 0.5)) / (x * (6.2 * x + 1.7) + 0.06);
    if ENCODE_SRGB {
        return vec4f(c, 1.0);
    }
    return vec4f(linear(c), 1.0);
}
