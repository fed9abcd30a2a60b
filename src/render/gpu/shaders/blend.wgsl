// What blending along silhouettes changes: the gradient with respect to the colours of pixels that are marked, and the loss.
@compute @workgroup_size(64)
fn blend(@builtin(global_invocation_id) id: vec3<u32>) {
    if id.x >= silhouette_count[3] {
        return;
    }
    let at = silhouettes[id.x];
    let view = at / batch.edges;
    let s = silhouette_of(view, at % batch.edges);
    let size = views[view].size;
    let stride = views[view].stride;
    let start = views[view].pixels;
    var sum = 0.0;
    let lines = lines_of(s, size);
    // Each crossing has a pixel on its either side.
    for (var i = 2u * lines.x; i < 2u * lines.y; i++) {
        let c = crossing_of(s, i / 2u, size, stride);
        if c.found && marks[2u * (start + c.first) + s.axis] == mark_of(s, c) {
            let place = select(c.first, c.second, i % 2u == 1u);
            let pixel = vec2<u32>(place % stride, place / stride);
            if is_first(view, pixel, s.axis + 2u * (i % 2u)) {
                sum += blend_pixel(view, pixel);
            }
        }
    }
    edge_losses[at] = sum;
}

// Returns by how much a pixel's loss changes.
fn blend_pixel(view: u32, pixel: vec2<u32>) -> f32 {
    let at = views[view].pixels + pixel.y * views[view].stride + pixel.x;
    let wanted = wanted_at(view, views[view].target_pixels + pixel.y * views[view].size.x + pixel.x);
    let before = abs(colours[at].xyz - wanted.xyz);
    let difference = blended(view, pixel) - wanted.xyz;
    blends[at] = vec4<f32>(sign(difference) * (wanted.w * batch.scale), 0.0);
    return dot(abs(difference) - before, vec3<f32>(wanted.w));
}
