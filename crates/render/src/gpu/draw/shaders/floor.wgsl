// The floor, a plane that fades into the background, and the background itself.

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
    out.p = centre + (x * s.x + y * s.y) * (select(300.0, 5.0, FADES) * g.focus.w);
    out.clip = clip(out.p);
    return out;
}

@fragment
fn fs_floor(in: Ground) -> @location(0) vec4f {
    let within = pool(in.p);
    let share = lit(shadow_place(in.p, g.floor_normal.xyz)) * within;
    let far = far_out(in.p);
    let back = behind(in.p - g.eye.xyz);
    return ground(paint(), in.p.xy * 10.0, vec3f(within, haze(far), line_share(far)), share, back);
}

// The floor's colour under the key light and under the sky.
struct Paint {
    key: vec3f,
    sky: vec3f,
}

fn paint() -> Paint {
    let n = g.floor_normal.xyz;
    // a light at the camera meets the floor as it is seen from there at what the camera looks at
    let toward = select(LIGHT, -g.view_forward.xyz, AT_CAMERA);
    return Paint(g.floor_colour.rgb * KEY * (0.42 * saturate(dot(n, toward))), g.floor_colour.rgb * ambient(n, 1.0));
}

// Distance from the focus along the floor, in its radii.
fn far_out(p: vec3f) -> f32 {
    let arm = p - g.focus.xyz;
    return length(arm - g.floor_normal.xyz * dot(arm, g.floor_normal.xyz)) / g.focus.w;
}

// What lies behind everything in a direction of view: in the open the ground reaches to the horizon, whose haze is all that is below it.
fn behind(direction: vec3f) -> vec3f {
    if FADES {
        return background(direction);
    }
    let d = normalize(direction);
    return background(vec3f(d.x + 1e-6, d.y, max(d.z, 0.0)));
}

// How far the floor has faded into the background: a room's at its end, in the open by the air in between.
fn haze(far: f32) -> f32 {
    return select(1.0 - exp(-0.05 * far), smoothstep(0.9, 2.8, far), FADES);
}

// Strength of the grid's lines: there are none in the open.
fn line_share(far: f32) -> f32 {
    return select(0.0, 0.16, FADES) * (1.0 - smoothstep(0.5, 3.0, far));
}

// The floor's light. `lines` are its coordinates in spaces of the grid; `air`: within the pool, haze, strength of the lines.
fn ground(paint: Paint, lines: vec2f, air: vec3f, share: f32, back: vec3f) -> vec4f {
    let line = abs(fract(lines - 0.5) - 0.5);
    let width = fwidth(lines);
    let grid = max(1.0 - line.x / (width.x + 0.008), 1.0 - line.y / (width.y + 0.008));
    let colour = (paint.key * share + paint.sky * mix(FAR_SHARE, 1.0, air.x)) * (1.0 + saturate(grid) * air.z);
    return finish(mix(colour, back, air.y));
}

// The lean floor: a patch of cells under the shadow map and rings of cells around it, which no shadow reaches.
// What changes slowly is worked out at their corners.
const CELLS = 8u;
const RINGS = 12.0;

struct Cell {
    @builtin(position) clip: vec4f,
    @location(0) lines: vec2f,
    @location(1) air: vec3f,
    @location(2) at: vec3f,
    @location(3) @interpolate(flat) key: vec3f,
    @location(4) @interpolate(flat) sky: vec3f,
    @location(5) direction: vec3f, // of view
}

// A corner of the floor at a place in the patch, whose sides are 1 long.
fn cell(place: vec2f) -> Cell {
    let p = g.patch_centre.xyz + g.patch_x.xyz * place.x + g.patch_y.xyz * place.y;
    let far = far_out(p);
    var out: Cell;
    out.clip = clip(p);
    out.lines = p.xy * 10.0;
    out.air = vec3f(pool(p), haze(far), line_share(far));
    out.at = shadow_place(p, g.floor_normal.xyz);
    let paint = paint();
    out.key = paint.key;
    out.sky = paint.sky;
    out.direction = p - g.eye.xyz;
    return out;
}

// The corner of a quad of two triangles.
fn corner_of(vertex: u32) -> vec2u {
    let i = vertex % 6u;
    return vec2u(u32(i == 1u || i == 2u || i == 4u), u32(i == 2u || i >= 4u));
}

@vertex
fn vs_floor_patch(@builtin(vertex_index) vertex: u32) -> Cell {
    let quad = vertex / 6u;
    let at = vec2u(quad % CELLS, quad / CELLS) + corner_of(vertex);
    return cell(vec2f(at) / f32(CELLS) - 0.5);
}

@vertex
fn vs_floor_rings(@builtin(vertex_index) vertex: u32) -> Cell {
    let quad = vertex / 6u;
    let corner = corner_of(vertex);
    let around = (quad + corner.x) % (4u * CELLS);
    let ring = (quad / (4u * CELLS)) + corner.y;
    let side = around / CELLS;
    let t = f32(around % CELLS) / f32(CELLS) - 0.5;
    // along the four sides of a square, one after the other
    var place = vec2f(t, -0.5);
    place = select(place, vec2f(0.5, t), side == 1u);
    place = select(place, vec2f(-t, 0.5), side == 2u);
    place = select(place, vec2f(-0.5, -t), side == 3u);
    return cell(place * pow(g.patch_centre.w, f32(ring) / RINGS));
}

@fragment
fn fs_floor_patch(in: Cell) -> @location(0) vec4f {
    return ground(Paint(in.key, in.sky), in.lines, in.air, lit(in.at) * in.air.x, behind(in.direction));
}

@fragment
fn fs_floor_rings(in: Cell) -> @location(0) vec4f {
    return ground(Paint(in.key, in.sky), in.lines, in.air, in.air.x, behind(in.direction));
}

struct Room {
    @builtin(position) clip: vec4f,
    @location(0) direction: vec3f,
}

@vertex
fn vs_room(@builtin(vertex_index) corner: u32) -> Room {
    var out: Room;
    out.clip = vec4f(f32(corner & 1u) * 4.0 - 1.0, f32(corner >> 1u) * 4.0 - 1.0, 0.0, 1.0);
    out.direction = g.view_forward.xyz + g.view_right.xyz * out.clip.x + g.view_up.xyz * out.clip.y;
    return out;
}

@fragment
fn fs_room(in: Room) -> @location(0) vec4f {
    return finish(behind(in.direction));
}
