// The floor, a plane that fades into the room, and the room itself.

struct Ground {
    @builtin(position) clip: vec4f,
    @location(0) p: vec3f,
}

@vertex
fn vs_floor(@builtin(vertex_index) corner: u32) -> Ground {
    let n = g.floor_normal.xyz;
    let x = normalize(select(cross(vec3f(0.0, 1.0, 0.0), n), vec3f(1.0, 0.0, 0.0), abs(n.z) > 0.999));
    let y = cross(n, x);
    let centre = g.focus.xyz - n * dot(g.focus.xyz - g.floor_point.xyz, n);
    let s = vec2f(f32(corner & 1u), f32(corner >> 1u)) * 2.0 - 1.0;
    var out: Ground;
    out.p = centre + (x * s.x + y * s.y) * (5.0 * g.focus.w);
    out.clip = clip(out.p);
    return out;
}

@fragment
fn fs_floor(in: Ground) -> @location(0) vec4f {
    let arm = in.p - g.focus.xyz;
    let far = length(arm - g.floor_normal.xyz * dot(arm, g.floor_normal.xyz)) / g.focus.w;
    let n = g.floor_normal.xyz;
    let light = pool(in.p);
    let share = lit(in.p, n) * light;
    let line = abs(fract(in.p.xy * 10.0 - 0.5) - 0.5);
    let width = fwidth(in.p.xy * 10.0);
    let grid = max(1.0 - line.x / (width.x + 0.008), 1.0 - line.y / (width.y + 0.008));
    let albedo = g.floor_colour.rgb * (1.0 + 0.16 * saturate(grid) * (1.0 - smoothstep(0.5, 3.0, far)));
    let colour = albedo * (KEY * share * 0.42 * saturate(dot(n, g.light.xyz)) + SKY * (0.25 + 0.75 * light));
    return finish(mix(colour, room(in.clip.xy), smoothstep(0.9, 2.8, far)));
}

struct Room {
    @builtin(position) clip: vec4f,
}

@vertex
fn vs_room(@builtin(vertex_index) corner: u32) -> Room {
    var out: Room;
    out.clip = vec4f(f32(corner & 1u) * 4.0 - 1.0, f32(corner >> 1u) * 4.0 - 1.0, 0.0, 1.0);
    return out;
}

@fragment
fn fs_room(in: Room) -> @location(0) vec4f {
    return finish(room(in.clip.xy));
}
