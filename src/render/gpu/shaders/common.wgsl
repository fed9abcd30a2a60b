// What the kernels share: the layout of buffers, and what several of them compute. A kernel binds what it uses.

struct Batch {
    views: u32,
    vertices: u32,
    triangles: u32,
    edges: u32,
    // Whether back faces are left out, and surfaces have albedo.
    closed: u32,
    with_albedo: u32,
    // Most strips in a view.
    strips: u32,
    // 1 / (3 sum w).
    scale: f32,
}

struct View {
    // H: a position p has (u w, v w, w) = rows (p, 1).
    rows: array<vec4<f32>, 3>,
    // L.
    light: array<vec4<f32>, 9>,
    size: vec2<u32>,
    // Pixels in a row, with what fills it up.
    stride: u32,
    // Where this view begins among pixels, and among the targets' pixels, whose rows are not filled up.
    pixels: u32,
    target_pixels: u32,
    // Targets are kept in 16 bits a number: colours from the lowest on, and weights up to the heaviest.
    lowest: f32,
    span: f32,
    heaviest: f32,
    padding: array<vec4<f32>, 2>,
}

const NEAR: f32 = 1e-6;
const LEAST_AREA: f32 = 0.03125;
const LEAST_NORMAL: f32 = 1e-6;
const RIM: u32 = 0xffffffffu;
// Threads in a row of pixels, and rows in a strip, of which a thread sums up its own.
const ROW: u32 = 64u;
const STRIP: u32 = 16u;
// Views of which a triangle's gradient is summed up by one thread.
const GROUP: u32 = 4u;

@group(0) @binding(0) var<uniform> batch: Batch;
@group(0) @binding(1) var<storage, read> views: array<View>;
@group(0) @binding(2) var<storage, read> positions: array<vec4<f32>>;
@group(0) @binding(3) var<storage, read> normals: array<vec4<f32>>;
@group(0) @binding(4) var<storage, read> albedo: array<vec4<f32>>;
@group(0) @binding(5) var<storage, read> triangles: array<u32>;
@group(0) @binding(6) var<storage, read> edges: array<vec4<u32>>;
// The places of vertices among triangles and edges, a row a vertex: how rows begin, then the rows.
@group(0) @binding(7) var<storage, read> corner_rows: array<u32>;
@group(0) @binding(8) var<storage, read> end_rows: array<u32>;
@group(0) @binding(9) var<storage, read> targets: array<vec2<u32>>;
// (u w, v w, w, 1 / w), the last zero for what is not before the camera.
@group(0) @binding(10) var<storage, read_write> corners: array<vec4<f32>>;
// What pixels' centres see, and one more than the triangle's index; 0 for none.
@group(0) @binding(11) var<storage, read> colours: array<vec4<f32>>;
@group(0) @binding(12) var<storage, read_write> marks: array<u32>;
// The gradient with respect to the colours: each channel's sign plus one in two bits, then a bit where blending changes it,
// which `changed` has, and in the upper half the weight.
@group(0) @binding(13) var<storage, read_write> pulled: array<u32>;
// The same with respect to blended colours, at pixels that are marked; pictures where they are asked for.
@group(0) @binding(14) var<storage, read_write> blends: array<vec4<f32>>;
@group(0) @binding(15) var<storage, read_write> strip_losses: array<f32>;
@group(0) @binding(16) var<storage, read_write> triangle_gradients: array<f32>;
@group(0) @binding(17) var<storage, read_write> edge_gradients: array<f32>;
// What blending adds to the loss, for each edge in each view.
@group(0) @binding(18) var<storage, read_write> edge_losses: array<f32>;
// Edges that are silhouettes, as view * edges + edge, in any order.
@group(0) @binding(19) var<storage, read> silhouettes: array<u32>;
// Workgroups for them (x, y, z), and how many they are.
@group(0) @binding(20) var<storage, read> silhouette_count: array<u32>;
// The gradient where blending changes it.
@group(0) @binding(23) var<storage, read_write> changed: array<vec4<f32>>;
// 6 or 9 numbers a vertex, then ROW sums of each view's loss; batches add to those before.
@group(0) @binding(21) var<storage, read_write> result: array<f32>;

fn corner(view: u32, vertex: u32) -> vec4<f32> {
    return corners[view * batch.vertices + vertex];
}

const CHANGED: u32 = 64u;

fn signs_of(difference: vec3<f32>) -> u32 {
    let signs = vec3<u32>(sign(difference) + 1.0);
    return signs.x | signs.y << 2u | signs.z << 4u;
}

// The gradient of which `pulled` has the signs and the weight.
fn pull_of(view: u32, packed: u32) -> vec3<f32> {
    let signs = vec3<f32>(vec3<u32>(packed, packed >> 2u, packed >> 4u) & vec3<u32>(3u)) - 1.0;
    return signs * (f32(packed >> 16u) * (views[view].heaviest * batch.scale / 65535.0));
}

// A target's colour and weight.
fn wanted_at(view: u32, at: u32) -> vec4<f32> {
    let packed = targets[at];
    let numbers = vec4<f32>(unpack2x16unorm(packed.x), unpack2x16unorm(packed.y));
    return numbers * vec4<f32>(vec3<f32>(views[view].span), views[view].heaviest)
        + vec4<f32>(vec3<f32>(views[view].lowest), 0.0);
}

fn cross2(a: vec2<f32>, b: vec2<f32>) -> f32 {
    return a.x * b.y - a.y * b.x;
}

fn pixel_of(corner: vec4<f32>) -> vec2<f32> {
    return corner.xy * corner.w;
}

// The homogeneous corner as seen start a pixel's centre.
fn seen_from(corner: vec4<f32>, pixel: vec2<f32>) -> vec3<f32> {
    return vec3<f32>(corner.xy - (pixel + 0.5) * corner.z, corner.z);
}

// Weights of corners, start a: see `patch.rs` of the reference.
fn weights_of(a: vec3<f32>, inverse_sum: f32) -> vec3<f32> {
    let clamped = max(a * inverse_sum, vec3<f32>(0.0));
    let total = clamped.x + clamped.y + clamped.z;
    return clamped * select(1.0 / total, 0.0, total == 0.0);
}

fn inverse_of(sum: f32) -> f32 {
    return select(1.0 / sum, 0.0, sum == 0.0);
}

fn light_colour(light: array<vec4<f32>, 9>, n: vec3<f32>) -> vec3<f32> {
    return light[0].xyz + light[1].xyz * n.x + light[2].xyz * n.y
        + light[3].xyz * n.z + light[4].xyz * (n.x * n.y)
        + light[5].xyz * (n.y * n.z) + light[6].xyz * (3.0 * n.z * n.z - 1.0)
        + light[7].xyz * (n.x * n.z) + light[8].xyz * (n.x * n.x - n.y * n.y);
}

// Silhouettes, as `silhouette.rs` of the reference.

struct Silhouette {
    // Whether it is one.
    found: bool,
    edge: u32,
    axis: u32,
    first_is_inner: bool,
    // Places of the ends (across, along) the lines that are crossed, and their 1 / w.
    a: vec2<f32>,
    b: vec2<f32>,
    nearness: vec2<f32>,
}

struct Crossing {
    // Whether it lies between two pixels of the picture.
    found: bool,
    // Places of the pixels start the view's first.
    first: u32,
    second: u32,
    place: f32,
    along: f32,
}

fn silhouette_of(view: u32, edge: u32) -> Silhouette {
    var s: Silhouette;
    s.found = false;
    let ends = edges[edge];
    let a = corner(view, ends.x);
    let b = corner(view, ends.y);
    let c = corner(view, ends.z);
    let start = pixel_of(a);
    let run = pixel_of(b) - start;
    let side = cross2(run, pixel_of(c) - start);
    var before = min(min(a.w, b.w), c.w);
    if ends.w != RIM {
        let d = corner(view, ends.w);
        before = min(before, d.w);
        if (side < 0.0) != (cross2(run, pixel_of(d) - start) < 0.0) {
            return s;
        }
    }
    if before <= 0.0 {
        return s;
    }
    s.found = true;
    s.edge = edge;
    s.axis = select(0u, 1u, abs(run.y) < abs(run.x));
    s.first_is_inner = (side < 0.0) != (select(-run.y, run.x, s.axis == 1u) < 0.0);
    let pixels = array<vec2<f32>, 2>(start - 0.5, pixel_of(b) - 0.5);
    s.a = select(pixels[0], pixels[0].yx, s.axis == 1u);
    s.b = select(pixels[1], pixels[1].yx, s.axis == 1u);
    s.nearness = vec2<f32>(a.w, b.w);
    return s;
}

// The lines that it crosses: first, and one after the last.
fn lines_of(s: Silhouette, size: vec2<u32>) -> vec2<u32> {
    let count = f32(select(size.y, size.x, s.axis == 1u));
    let low = clamp(ceil(min(s.a.y, s.b.y)), 0.0, count);
    let high = clamp(ceil(max(s.a.y, s.b.y)), 0.0, count);
    return vec2<u32>(u32(low), u32(high));
}

fn crossing_of(s: Silhouette, line: u32, size: vec2<u32>, stride: u32) -> Crossing {
    var c: Crossing;
    c.along = (f32(line) - s.a.y) / (s.b.y - s.a.y);
    let at = s.a.x + (s.b.x - s.a.x) * c.along;
    let before = floor(at);
    c.found = before >= 0.0 && before + 1.0 < f32(select(size.x, size.y, s.axis == 1u));
    let step = select(vec2<u32>(1u, stride), vec2<u32>(stride, 1u), s.axis == 1u);
    c.first = u32(max(before, 0.0)) * step.x + line * step.y;
    c.second = c.first + step.x;
    c.place = at - before;
    return c;
}

fn mark_of(s: Silhouette, c: Crossing) -> u32 {
    let out = select(1.0 - c.place, c.place, s.first_is_inner);
    return (min(u32(out * 254.0) + 1u, 255u) << 24u) | (s.edge + 1u);
}

// The place of the crossing that a mark tells of, start the first pixel, which is `pixel`; axis as of the mark.
fn place_of(view: u32, mark: u32, axis: u32, pixel: vec2<u32>) -> f32 {
    let s = silhouette_of(view, (mark & 0xffffffu) - 1u);
    let line = select(pixel.y, pixel.x, axis == 1u);
    return crossing_of(s, line, views[view].size, views[view].stride).place;
}

// Whether a mark is the first of its pixel's four, in whose name the pixel is worked on: 0 to 3 for those on the right, below,
// on the left, above.
fn is_first(view: u32, pixel: vec2<u32>, side: u32) -> bool {
    let all = marks_of(view, pixel);
    let before = vec4<u32>(0u, all.x, all.x | all.y, all.x | all.y | all.z);
    return before[side] == 0u;
}

// Marks on a pixel's right, below it, on its left and above.
fn marks_of(view: u32, pixel: vec2<u32>) -> vec4<u32> {
    let stride = views[view].stride;
    let at = 2u * (views[view].pixels + pixel.y * stride + pixel.x);
    var all = vec4<u32>(marks[at], marks[at + 1u], 0u, 0u);
    if pixel.x > 0u {
        all.z = marks[at - 2u];
    }
    if pixel.y > 0u {
        all.w = marks[at - 2u * stride + 1u];
    }
    return all;
}

// What is blended at a pixel: the share of the other's colour with each of its four neighbours, in the order of its marks;
// negative where it is the neighbour that takes of this one's.
fn shares_of(view: u32, pixel: vec2<u32>) -> vec4<f32> {
    let all = marks_of(view, pixel);
    var shares = vec4<f32>(0.0);
    for (var side = 0u; side < 4u; side++) {
        if all[side] != 0u {
            let first = pixel - select(vec2<u32>(0u), vec2<u32>(1u - side % 2u, side % 2u), side > 1u);
            let share = 0.5 - place_of(view, all[side], side % 2u, first);
            shares[side] = select(share, -share, side > 1u);
        }
    }
    return shares;
}

fn blended(view: u32, pixel: vec2<u32>) -> vec3<f32> {
    let stride = views[view].stride;
    let at = views[view].pixels + pixel.y * stride + pixel.x;
    let own = colours[at].xyz;
    let shares = shares_of(view, pixel);
    var colour = own;
    if shares.x > 0.0 {
        colour += (colours[at + 1u].xyz - own) * shares.x;
    }
    if shares.y > 0.0 {
        colour += (colours[at + stride].xyz - own) * shares.y;
    }
    if shares.z > 0.0 {
        colour += (colours[at - 1u].xyz - own) * shares.z;
    }
    if shares.w > 0.0 {
        colour += (colours[at - stride].xyz - own) * shares.w;
    }
    return colour;
}
