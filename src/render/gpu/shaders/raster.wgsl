// Which triangle each pixel's centre sees: one more than its index, 0 for none. Drawn once for each view.

struct Seen {
    @builtin(position) place: vec4<f32>,
    @location(0) @interpolate(flat) id: u32,
}

@group(0) @binding(23) var<storage, read> drawn: array<vec4<f32>>;

@vertex
fn place(@builtin(vertex_index) index: u32, @builtin(instance_index) view: u32) -> Seen {
    let corner = drawn[view * batch.vertices + triangles[index]];
    let size = vec2<f32>(views[view].size);
    var seen: Seen;
    // Depth is NEAR / w: the larger is the nearer.
    seen.place = vec4<f32>(
        corner.x * 2.0 / size.x - corner.z,
        corner.z - corner.y * 2.0 / size.y,
        NEAR,
        corner.z,
    );
    seen.id = index / 3u + 1u;
    return seen;
}

@fragment
fn number(seen: Seen) -> @location(0) u32 {
    return seen.id;
}
