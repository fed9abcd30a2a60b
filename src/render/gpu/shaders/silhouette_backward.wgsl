// What the crossings of each edge in each view ask of its ends.
@compute @workgroup_size(64)
fn silhouette_backward(@builtin(global_invocation_id) id: vec3<u32>) {
    let view = id.y;
    if id.x >= batch.edges {
        return;
    }
    // Sum of dE / d place, and of the same times the share of the way along.
    var sum = vec2<f32>(0.0);
    let s = silhouette_of(view, id.x);
    if s.found {
        let size = views[view].size;
        let first = views[view].pixels;
        let lines = lines_of(s, size);
        for (var line = lines.x; line < lines.y; line++) {
            let c = crossing_of(s, line, size);
            if c.found && marks[2u * (first + c.first) + s.axis] == mark_of(s, c) {
                let crossed = select(c.second, c.first, c.place < 0.5);
                let across = colours[first + c.first].xyz - colours[first + c.second].xyz;
                sum += dot(pulled[first + crossed].xyz, across) * vec2<f32>(1.0, c.along);
            }
        }
    }
    let at = 3u * (view * batch.edges + id.x);
    if !s.found || (sum.x == 0.0 && sum.y == 0.0) {
        edge_gradients[at] = vec2<f32>(0.0);
        edge_gradients[at + 1u] = vec2<f32>(0.0);
        edge_gradients[at + 2u] = vec2<f32>(0.0);
        return;
    }
    let ends = edges[id.x].xy;
    let slope = (s.b.x - s.a.x) / (s.b.y - s.a.y);
    let a = end_gradient(view, corner(view, ends.x), s.axis, sum.x - sum.y, slope);
    let b = end_gradient(view, corner(view, ends.y), s.axis, sum.y, slope);
    edge_gradients[at] = a.xy;
    edge_gradients[at + 1u] = vec2<f32>(a.z, b.x);
    edge_gradients[at + 2u] = b.yz;
}

fn end_gradient(view: u32, corner: vec4<f32>, axis: u32, across: f32, slope: f32) -> vec3<f32> {
    let turned = vec2<f32>(across, -across * slope);
    let pixel = select(turned, turned.yx, axis == 1u) * corner.w;
    return views[view].rows[0].xyz * pixel.x + views[view].rows[1].xyz * pixel.y
        - views[view].rows[2].xyz * dot(pixel, pixel_of(corner));
}
