// The colour of what each pixel's centre sees, and which triangle that is: one more than its index, exact up to 2^24. Drawn
// once for each view.

struct Seen {
    @builtin(position) place: vec4<f32>,
    @location(0) @interpolate(flat) id: f32,
    @location(1) normal: vec3<f32>,
    @location(2) albedo: vec3<f32>,
}

@group(0) @binding(22) var<storage, read> drawn: array<vec4<f32>>;
// The vertex of each place of the draw order; the first ones are first corners of the triangles of their number.
@group(0) @binding(24) var<storage, read> draw_order: array<u32>;
@group(1) @binding(0) var<uniform> shown_view: View;

override WITH_ALBEDO: bool;

@vertex
fn place(@builtin(vertex_index) at: u32, @builtin(instance_index) view: u32) -> Seen {
    let vertex = draw_order[at];
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
    seen.id = f32(at + 1u);
    seen.normal = normals[vertex].xyz;
    seen.albedo = albedo[vertex].xyz;
    return seen;
}

@fragment
fn shade(seen: Seen) -> @location(0) vec4<f32> {
    let normal = seen.normal / max(length(seen.normal), LEAST_NORMAL);
    var colour = light_colour(shown_view.light, normal);
    // What no pixel asks for is not placed either.
    if WITH_ALBEDO {
        colour *= seen.albedo;
    }
    return vec4<f32>(colour, seen.id);
}
