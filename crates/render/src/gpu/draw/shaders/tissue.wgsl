// Wet tissue: mottled, veined, with a film of water over small folds. Precedes skin.wgsl and hide.wgsl.

// What tissue looks like at a pixel.
struct Flesh {
    albedo: vec3f,
    n: vec3f,
    gloss: f32,
}

// Its texture: mottling, veins, slopes of the folds along and across.
fn sampled(uv: vec2f) -> vec4f {
    return textureSample(tissue_map, tissue_sampler, uv);
}

// Colour and film of a texture, with the normal still to be turned by the folds.
fn coloured(tissue: vec4f, n: vec3f, colour: vec3f, tint: vec4f) -> Flesh {
    let plain = 1.0 - tint.a;
    var out: Flesh;
    out.albedo = colour * (0.50 + 0.85 * tissue.r);
    out.albedo = mix(out.albedo, colour * vec3f(0.55, 0.10, 0.15), 0.85 * plain * tissue.g);
    out.albedo = mix(out.albedo, tint.rgb, tint.a);
    out.n = n;
    out.gloss = 0.55 + 0.45 * plain;
    return out;
}

// How steep the folds are.
fn fold_share(tint: vec4f) -> f32 {
    return 0.85 * (1.0 - tint.a) + 0.15;
}

// Tissue whose texture lies along `t`.
fn flesh(tissue: vec4f, n0: vec3f, t: vec3f, colour: vec3f, tint: vec4f) -> Flesh {
    var out = coloured(tissue, n0, colour, tint);
    let fold = (tissue.ba - 0.5) * fold_share(tint);
    out.n = normalize(n0 - t * fold.x - cross(t, n0) * fold.y);
    return out;
}
