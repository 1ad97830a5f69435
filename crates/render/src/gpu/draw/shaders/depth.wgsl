// Shows depths as greys: white is at the eye, middle grey as far as the camera's target, black nothing.

@group(0) @binding(0) var depths: texture_depth_2d;
@group(0) @binding(1) var<uniform> at_target: vec4f; // x: over the depth that is stored of the camera's target

@fragment
fn fs_depth(@builtin(position) at: vec4f) -> @location(0) vec4f {
    let nearness = textureLoad(depths, vec2i(at.xy), 0) * at_target.x;
    return vec4f(vec3f(nearness / (1.0 + nearness)), 1.0);
}
