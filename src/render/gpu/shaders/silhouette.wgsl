// Where the edges between what is seen and what is not cross the lines between neighbouring pixels' centres: for each edge
// and view. Of several edges on one line the one that is farthest out is marked: a greatest integer, in any order. Marks
// and counts are zero before.

@group(0) @binding(12) var<storage, read_write> greatest: array<atomic<u32>>;
@group(0) @binding(19) var<storage, read_write> listed: array<u32>;
@group(0) @binding(20) var<storage, read_write> count: array<atomic<u32>, 4>;

@compute @workgroup_size(64)
fn silhouette(@builtin(global_invocation_id) id: vec3<u32>, @builtin(workgroup_id) group: vec3<u32>) {
    let view = group.y;
    if id.x >= batch.edges {
        return;
    }
    let s = silhouette_of(view, id.x);
    if !s.found {
        return;
    }
    let size = views[view].size;
    let stride = views[view].stride;
    let lines = lines_of(s, size);
    var seen = false;
    for (var line = lines.x; line < lines.y; line++) {
        let c = crossing_of(s, line, size, stride);
        if c.found && is_seen(view, s, c) {
            atomicMax(&greatest[2u * (views[view].pixels + c.first) + s.axis], mark_of(s, c));
            seen = true;
        }
    }
    if seen {
        let at = atomicAdd(&count[3], 1u);
        listed[at] = view * batch.edges + id.x;
        if at % 64u == 0u {
            atomicAdd(&count[0], 1u);
        }
        if at == 0u {
            atomicStore(&count[1], 1u);
            atomicStore(&count[2], 1u);
        }
    }
}

fn is_seen(view: u32, s: Silhouette, c: Crossing) -> bool {
    let inner = id_at(view, select(c.second, c.first, s.first_is_inner));
    let place = select(c.first, c.second, s.first_is_inner);
    let outer = id_at(view, place);
    if inner == 0u || inner == outer {
        return false;
    }
    return outer == 0u || nearness(view, outer, place) < s.nearness.x + (s.nearness.y - s.nearness.x) * c.along;
}

fn id_at(view: u32, place: u32) -> u32 {
    return u32(colours[views[view].pixels + place].w);
}

// 1 / w of a triangle at a pixel's centre: linear on the picture.
fn nearness(view: u32, id: u32, place: u32) -> f32 {
    let stride = views[view].stride;
    let at = vec2<f32>(f32(place % stride), f32(place / stride)) + 0.5;
    let a = corner(view, triangles[3u * id - 3u]);
    let b = corner(view, triangles[3u * id - 2u]);
    let c = corner(view, triangles[3u * id - 1u]);
    let pa = pixel_of(a) - at;
    let pb = pixel_of(b) - at;
    let pc = pixel_of(c) - at;
    let parts = vec3<f32>(cross2(pb, pc), cross2(pc, pa), cross2(pa, pb));
    return dot(parts, vec3<f32>(a.w, b.w, c.w)) * inverse_of(parts.x + parts.y + parts.z);
}
