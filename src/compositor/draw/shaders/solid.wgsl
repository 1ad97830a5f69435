// Solids: a core swept by a ball, turned and moved, one instance each.

struct Corner {
    @location(0) core: vec3f,
    @location(1) normal: vec3f,
    @location(2) rotation: vec4f,
    @location(3) place: vec4f,
    @location(4) extents: vec4f,
    @location(5) colour: vec4f,
    @location(6) tint: vec4f,
}

struct Solid {
    @builtin(position) clip: vec4f,
    @location(0) p: vec3f,
    @location(1) n: vec3f,
    @location(2) own: vec3f,
    @location(3) @interpolate(flat) colour: vec3f,
    @location(4) @interpolate(flat) tint: vec4f,
    @location(5) @interpolate(flat) m: vec4f,
    @location(6) @interpolate(flat) k: vec4f,
}

fn turned(q: vec4f, v: vec3f) -> vec3f {
    return v + 2.0 * cross(q.xyz, cross(q.xyz, v) + q.w * v);
}

@vertex
fn vs_solid(in: Corner) -> Solid {
    let own = in.core * in.extents.xyz + in.normal * in.place.w;
    var out: Solid;
    out.p = turned(in.rotation, own) + in.place.xyz;
    out.n = turned(in.rotation, in.normal);
    out.clip = clip(out.p);
    out.own = own;
    let material = 2u * u32(round(in.colour.a * 255.0));
    out.m = g.materials[material];
    out.k = g.materials[material + 1u];
    out.colour = linear(in.colour.rgb);
    out.tint = vec4f(linear(in.tint.rgb), in.tint.a);
    return out;
}

@vertex
fn vs_solid_shadow(in: Corner) -> @builtin(position) vec4f {
    let own = in.core * in.extents.xyz + in.normal * in.place.w;
    let at = g.light_projection * vec4f(turned(in.rotation, own) + in.place.xyz, 1.0);
    return vec4f(at.x * 2.0 - 1.0, 1.0 - at.y * 2.0, at.z, 1.0);
}

@fragment
fn fs_solid(in: Solid) -> @location(0) vec4f {
    let n0 = normalize(in.n);
    // brushed around the axis: fine grooves scatter light along it, as long as they are wider than pixels
    let groove = abs(fract(in.own.z * 1400.0) - 0.5) + abs(fract(in.own.z * 590.0 + in.own.x * 140.0) - 0.5) - 0.5;
    let fade = saturate(1.0 - 2600.0 * abs(dpdx(in.own.z)) - 2600.0 * abs(dpdy(in.own.z)));
    let n = normalize(n0 + vec3f(0.06, -0.04, 0.10) * (groove * in.k.w * fade));
    let albedo = mix(in.colour, in.tint.rgb, in.tint.a);
    return finish(shade(Surface(in.p, n, n0, albedo, in.m, in.k, 1.0, 1.0)));
}

@fragment
fn fs_solid_edge(in: Solid) -> @location(0) vec4f {
    return finish(mix(vec3f(0.55, 0.62, 0.68), in.tint.rgb * 2.2, in.tint.a * 0.7));
}
