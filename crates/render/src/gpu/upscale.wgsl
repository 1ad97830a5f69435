// Shows a picture on a target of its own size, or enlarged to the target's.

@group(0) @binding(0) var drawn: texture_2d<f32>;
@group(0) @binding(1) var between: sampler;

@fragment
fn fs_same(in: Corner) -> @location(0) vec4f {
    let size = textureDimensions(drawn);
    let texel = min(vec2i(in.uv * vec2f(size)), vec2i(size) - 1);
    return vec4f(textureLoad(drawn, texel, 0).rgb, 1.0);
}

@fragment
fn fs_linear(in: Corner) -> @location(0) vec4f {
    return vec4f(filtered(in.uv), 1.0);
}

// Catmull and Rom's cubic of 4 × 4 texels by nine samples: of the two in the middle of each axis one sample between them gives both, at the
// place where the filter weighs them as the cubic does.
@fragment
fn fs_cubic(in: Corner) -> @location(0) vec4f {
    let texel = 1.0 / vec2f(textureDimensions(drawn));
    let place = in.uv / texel;
    let base = floor(place - 0.5) + 0.5;
    let f = place - base;
    let first = f * (-0.5 + f * (1.0 - 0.5 * f));
    let second = 1.0 + f * f * (1.5 * f - 2.5);
    let third = f * (0.5 + f * (2.0 - 1.5 * f));
    let last = f * f * (0.5 * f - 0.5);
    let middle = second + third;
    let at = array<vec2f, 3>(texel * (base - 1.0), texel * (base + third / middle), texel * (base + 2.0));
    let weights = array<vec2f, 3>(first, middle, last);
    var sum = vec3f(0.0);
    for (var y = 0; y < 3; y++) {
        for (var x = 0; x < 3; x++) {
            sum += filtered(vec2f(at[x].x, at[y].y)) * (weights[x].x * weights[y].y);
        }
    }
    return vec4f(sum, 1.0);
}

fn filtered(uv: vec2f) -> vec3f {
    return textureSampleLevel(drawn, between, uv, 0.0).rgb;
}
