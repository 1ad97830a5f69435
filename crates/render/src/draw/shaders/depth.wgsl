// Shows depths as greys: white is at the eye, middle grey as far as the camera's target, black nothing.

@group(0) @binding(0) var depths: texture_depth_2d;
@group(0) @binding(1) var<uniform> at_target: vec4f; // x: over the depth that is stored of the camera's target

@vertex
fn vs_depth(@builtin(vertex_index) i: u32) -> @builtin(position) vec4f {
    let uv = vec2f(f32((i << 1u) & 2u), f32(i & 2u));
    return vec4f(uv.x * 2.0 - 1.0, 1.0 - uv.y * 2.0, 0.0, 1.0);
}

@fragment
fn fs_depth(@builtin(position) at: vec4f) -> @location(0) vec4f {
    let nearness = textureLoad(depths, vec2i(at.xy), 0) * at_target.x;
    return vec4f(vec3f(nearness / (1.0 + nearness)), 1.0);
}
