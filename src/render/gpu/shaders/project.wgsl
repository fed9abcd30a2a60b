// Every vertex as every camera sees it.
@compute @workgroup_size(64)
fn project(@builtin(global_invocation_id) id: vec3<u32>, @builtin(workgroup_id) group: vec3<u32>) {
    let vertex = id.x;
    let view = group.y;
    if vertex >= batch.vertices {
        return;
    }
    let position = vec4<f32>(positions[vertex].xyz, 1.0);
    let h = vec3<f32>(
        dot(views[view].rows[0], position),
        dot(views[view].rows[1], position),
        dot(views[view].rows[2], position),
    );
    let inverse = select(1.0 / h.z, 0.0, h.z <= NEAR);
    corners[view * batch.vertices + vertex] = vec4<f32>(h, inverse);
}
