// The difference of pictures from their targets before they are blended, summed by each thread over its pixels of a strip of
// rows, and its gradient.
@compute @workgroup_size(64)
fn loss(@builtin(global_invocation_id) id: vec3<u32>, @builtin(workgroup_id) group: vec3<u32>) {
    let view = group.z;
    let size = views[view].size;
    let first = group.y * STRIP;
    if first >= size.y {
        return;
    }
    let start = views[view].pixels;
    let stride = views[view].stride;
    let wanted_start = views[view].target_pixels;
    var sum = 0.0;
    let end = min(first + STRIP, size.y);
    for (var y = first; y < end; y++) {
        for (var x = id.x; x < size.x; x += ROW) {
            let at = start + y * stride + x;
            let place = wanted_start + y * size.x + x;
            let wanted = wanted_at(view, place);
            let difference = colours[at].xyz - wanted.xyz;
            pulled[at] = signs_of(difference) | (targets[place].y & 0xffff0000u);
            let apart = abs(difference);
            sum += (apart.x + apart.y + apart.z) * wanted.w;
        }
    }
    strip_losses[(view * batch.strips + group.y) * ROW + id.x] = sum;
}
