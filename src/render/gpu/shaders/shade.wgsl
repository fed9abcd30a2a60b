// The colour of what each pixel's centre sees.
@compute @workgroup_size(64)
fn shade(@builtin(global_invocation_id) id: vec3<u32>, @builtin(workgroup_id) group: vec3<u32>) {
    let view = group.z;
    let y = group.y;
    let size = views[view].size;
    if id.x >= size.x || y >= size.y {
        return;
    }
    let at = views[view].pixels + y * size.x + id.x;
    let seen = ids[views[view].ids + y * views[view].stride + id.x];
    if seen == 0u {
        colours[at] = views[view].background;
        return;
    }
    let ends = vec3<u32>(triangles[3u * seen - 3u], triangles[3u * seen - 2u], triangles[3u * seen - 1u]);
    let pixel = vec2<f32>(vec2<u32>(id.x, y));
    let q0 = seen_from(corner(view, ends.x), pixel).xy;
    let q1 = seen_from(corner(view, ends.y), pixel).xy;
    let q2 = seen_from(corner(view, ends.z), pixel).xy;
    let a = vec3<f32>(cross2(q1, q2), cross2(q2, q0), cross2(q0, q1));
    let weights = weights_of(a, inverse_of(a.x + a.y + a.z));
    let n = normals[ends.x].xyz * weights.x + normals[ends.y].xyz * weights.y + normals[ends.z].xyz * weights.z;
    var colour = light_colour(views[view].light, n / max(length(n), LEAST_NORMAL));
    if batch.with_albedo != 0u {
        colour *= albedo[ends.x].xyz * weights.x + albedo[ends.y].xyz * weights.y + albedo[ends.z].xyz * weights.z;
    }
    colours[at] = vec4<f32>(colour, 1.0);
}
