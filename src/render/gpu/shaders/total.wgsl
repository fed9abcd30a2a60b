// Sums of each view's loss, behind the gradients: of its strips and its edges, each thread over its own.
@compute @workgroup_size(64)
fn total(@builtin(global_invocation_id) id: vec3<u32>, @builtin(workgroup_id) group: vec3<u32>) {
    let view = group.y;
    let strips = (views[view].size.y + STRIP - 1u) / STRIP;
    var sum = 0.0;
    for (var at = 0u; at < strips; at++) {
        sum += strip_losses[(view * batch.strips + at) * ROW + id.x];
    }
    for (var at = id.x; at < batch.edges; at += ROW) {
        sum += edge_losses[view * batch.edges + at];
    }
    result[select(6u, 9u, batch.with_albedo != 0u) * batch.vertices + view * ROW + id.x] += sum;
}
