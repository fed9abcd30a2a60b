// The sum over triangles and groups of views, then over edges and views, at each vertex, in their order.
@compute @workgroup_size(64)
fn gather(@builtin(global_invocation_id) id: vec3<u32>) {
    let vertex = id.x;
    if vertex >= batch.vertices {
        return;
    }
    let with_albedo = batch.with_albedo != 0u;
    let width = select(6u, 9u, with_albedo);
    var position = vec3<f32>(0.0);
    var normal = position;
    var colour = position;
    let rows = batch.vertices + 1u;
    let groups = (batch.views + GROUP - 1u) / GROUP;
    for (var group = 0u; group < groups; group++) {
        for (var k = corner_rows[vertex]; k < corner_rows[vertex + 1u]; k++) {
            let at = width * (3u * group * batch.triangles + corner_rows[rows + k]);
            position += triangle_gradient(at);
            normal += triangle_gradient(at + 3u);
            if with_albedo {
                colour += triangle_gradient(at + 6u);
            }
        }
    }
    for (var view = 0u; view < batch.views; view++) {
        for (var k = end_rows[vertex]; k < end_rows[vertex + 1u]; k++) {
            let end = end_rows[rows + k];
            let at = 6u * (view * batch.edges + end / 2u) + 3u * (end % 2u);
            position += vec3<f32>(edge_gradients[at], edge_gradients[at + 1u], edge_gradients[at + 2u]);
        }
    }
    add(width * vertex, position);
    add(width * vertex + 3u, normal);
    if with_albedo {
        add(width * vertex + 6u, colour);
    }
}

fn triangle_gradient(at: u32) -> vec3<f32> {
    return vec3<f32>(triangle_gradients[at], triangle_gradients[at + 1u], triangle_gradients[at + 2u]);
}

fn add(at: u32, value: vec3<f32>) {
    result[at] += value.x;
    result[at + 1u] += value.y;
    result[at + 2u] += value.z;
}
