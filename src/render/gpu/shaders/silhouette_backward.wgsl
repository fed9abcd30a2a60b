// What the crossings of each silhouette ask of its edge's ends, and of the colours that are blended there.
@compute @workgroup_size(64)
fn silhouette_backward(@builtin(global_invocation_id) id: vec3<u32>) {
    if id.x >= silhouette_count[3] {
        return;
    }
    let at = silhouettes[id.x];
    let view = at / batch.edges;
    let s = silhouette_of(view, at % batch.edges);
    let size = views[view].size;
    let stride = views[view].stride;
    let start = views[view].pixels;
    // Sum of dE / d place, and of the same times the share of the way along.
    var sum = vec2<f32>(0.0);
    let lines = lines_of(s, size);
    for (var line = lines.x; line < lines.y; line++) {
        let c = crossing_of(s, line, size, stride);
        if c.found && marks[2u * (start + c.first) + s.axis] == mark_of(s, c) {
            let crossed = select(c.second, c.first, c.place < 0.5);
            let across = colours[start + c.first].xyz - colours[start + c.second].xyz;
            sum += dot(blends[start + crossed].xyz, across) * vec2<f32>(1.0, c.along);
        }
    }
    for (var i = 2u * lines.x; i < 2u * lines.y; i++) {
        let c = crossing_of(s, i / 2u, size, stride);
        if c.found && marks[2u * (start + c.first) + s.axis] == mark_of(s, c) {
            let place = select(c.first, c.second, i % 2u == 1u);
            let pixel = vec2<u32>(place % stride, place / stride);
            if is_first(view, pixel, s.axis + 2u * (i % 2u)) {
                changed[start + place] = vec4<f32>(unblended(view, pixel), 0.0);
                pulled[start + place] |= CHANGED;
            }
        }
    }
    let ends = edges[s.edge].xy;
    let slope = (s.b.x - s.a.x) / (s.b.y - s.a.y);
    let a = end_gradient(view, corner(view, ends.x), s.axis, sum.x - sum.y, slope);
    let b = end_gradient(view, corner(view, ends.y), s.axis, sum.y, slope);
    put_end(6u * at, a);
    put_end(6u * at + 3u, b);
}

fn put_end(at: u32, value: vec3<f32>) {
    edge_gradients[at] = value.x;
    edge_gradients[at + 1u] = value.y;
    edge_gradients[at + 2u] = value.z;
}

fn end_gradient(view: u32, corner: vec4<f32>, axis: u32, across: f32, slope: f32) -> vec3<f32> {
    let turned = vec2<f32>(across, -across * slope);
    let pixel = select(turned, turned.yx, axis == 1u) * corner.w;
    return views[view].rows[0].xyz * pixel.x + views[view].rows[1].xyz * pixel.y
        - views[view].rows[2].xyz * dot(pixel, pixel_of(corner));
}

// The gradient with respect to a pixel's colour before it was blended.
fn unblended(view: u32, pixel: vec2<u32>) -> vec3<f32> {
    let stride = views[view].stride;
    let at = views[view].pixels + pixel.y * stride + pixel.x;
    let own = blends[at].xyz;
    let shares = shares_of(view, pixel);
    let taken = max(shares, vec4<f32>(0.0));
    var pull = own * (1.0 - taken.x - taken.y - taken.z - taken.w);
    if shares.x < 0.0 {
        pull -= blends[at + 1u].xyz * shares.x;
    }
    if shares.y < 0.0 {
        pull -= blends[at + stride].xyz * shares.y;
    }
    if shares.z < 0.0 {
        pull -= blends[at - 1u].xyz * shares.z;
    }
    if shares.w < 0.0 {
        pull -= blends[at - stride].xyz * shares.w;
    }
    return pull;
}
