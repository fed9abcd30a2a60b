// The colour of what each pixel's centre sees, and which triangle that is: one more than its index, exact up to 2^24. Drawn
// once for each view.

struct Seen {
    @builtin(position) place: vec4<f32>,
    @location(0) @interpolate(flat) id: f32,
    @location(1) normal: vec3<f32>,
    @location(2) albedo: vec3<f32>,
}

@group(0) @binding(22) var<storage, read> drawn: array<vec4<f32>>;
@group(1) @binding(0) var<uniform> shown_view: View;

@vertex
fn place(@builtin(vertex_index) index: u32, @builtin(instance_index) view: u32) -> Seen {
    let vertex = triangles[index];
    let corner = drawn[view * batch.vertices + vertex];
    let size = vec2<f32>(shown_view.size);
    var seen: Seen;
    // Depth is NEAR / w: the larger is the nearer.
    seen.place = vec4<f32>(
        corner.x * 2.0 / size.x - corner.z,
        corner.z - corner.y * 2.0 / size.y,
        NEAR,
        corner.z,
    );
    seen.id = f32(index / 3u + 1u);
    seen.normal = normals[vertex].xyz;
    seen.albedo = vec3<f32>(1.0);
    if batch.with_albedo != 0u {
        seen.albedo = albedo[vertex].xyz;
    }
    return seen;
}

@fragment
fn shade(seen: Seen) -> @location(0) vec4<f32> {
    let normal = seen.normal / max(length(seen.normal), LEAST_NORMAL);
    return vec4<f32>(light_colour(shown_view.light, normal) * seen.albedo, seen.id);
}
