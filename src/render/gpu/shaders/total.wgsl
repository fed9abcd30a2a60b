// Each view's loss, from its strips', behind the gradients.
@compute @workgroup_size(1)
fn total(@builtin(global_invocation_id) id: vec3<u32>) {
    let view = id.x;
    let strips = (views[view].size.y + STRIP - 1u) / STRIP;
    var sum = 0.0;
    for (var at = 0u; at < strips; at++) {
        var of_strip = 0.0;
        for (var x = 0u; x < ROW; x++) {
            of_strip += strip_losses[(view * batch.strips + at) * ROW + x];
        }
        sum += of_strip;
    }
    result[select(6u, 9u, batch.with_albedo != 0u) * batch.vertices + view] += sum;
}
