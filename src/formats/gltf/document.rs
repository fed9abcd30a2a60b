use std::cell::Cell;

use serde::Deserialize;
use serde_json::value::RawValue;

use crate::formats::error::Fault;

/// The parts of a glTF document that a mesh needs. The entries of its lists are parsed where they are used, so that a
/// long list takes little memory and a wrong entry is named.
#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct Document<'a> {
    #[serde(borrow)]
    asset: Option<&'a RawValue>,
    scene: Option<usize>,
    #[serde(borrow, default)]
    scenes: Vec<&'a RawValue>,
    #[serde(borrow, default)]
    nodes: Vec<&'a RawValue>,
    #[serde(borrow, default)]
    meshes: Vec<&'a RawValue>,
    #[serde(borrow, default)]
    accessors: Vec<&'a RawValue>,
    #[serde(borrow, default)]
    buffer_views: Vec<&'a RawValue>,
    #[serde(borrow, default)]
    buffers: Vec<&'a RawValue>,
    #[serde(borrow, default)]
    materials: Vec<&'a RawValue>,
    #[serde(borrow, default)]
    textures: Vec<&'a RawValue>,
    #[serde(borrow, default)]
    images: Vec<&'a RawValue>,
    #[serde(default)]
    extensions_required: Vec<String>,
    /// Bytes of entries that may still be parsed.
    #[serde(skip)]
    work: Cell<usize>,
}

#[derive(Deserialize)]
pub(super) struct Asset {
    version: String,
    pub generator: Option<String>,
}

#[derive(Deserialize)]
struct Scene {
    #[serde(default)]
    nodes: Vec<usize>,
}

#[derive(Deserialize)]
pub(super) struct Node {
    pub mesh: Option<usize>,
    pub skin: Option<usize>,
    #[serde(default)]
    pub children: Vec<usize>,
    /// By columns.
    pub matrix: Option<[f64; 16]>,
    pub translation: Option<[f64; 3]>,
    /// A quaternion: x, y, z, w.
    pub rotation: Option<[f64; 4]>,
    pub scale: Option<[f64; 3]>,
}

#[derive(Deserialize)]
pub(super) struct Mesh {
    pub primitives: Vec<Primitive>,
}

#[derive(Deserialize)]
pub(super) struct Primitive {
    pub attributes: Attributes,
    pub indices: Option<usize>,
    pub material: Option<usize>,
    #[serde(default = "triangles")]
    pub mode: u32,
}

fn triangles() -> u32 {
    4
}

#[derive(Deserialize)]
pub(super) struct Attributes {
    #[serde(rename = "POSITION")]
    pub position: Option<usize>,
    #[serde(rename = "NORMAL")]
    pub normal: Option<usize>,
    #[serde(rename = "COLOR_0")]
    pub colour: Option<usize>,
    #[serde(rename = "TEXCOORD_0")]
    coordinates_0: Option<usize>,
    #[serde(rename = "TEXCOORD_1")]
    coordinates_1: Option<usize>,
}

impl Attributes {
    /// The texture coordinates of this set.
    pub fn coordinates(&self, set: usize) -> Option<usize> {
        match set {
            0 => self.coordinates_0,
            1 => self.coordinates_1,
            _ => None,
        }
    }
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct Material {
    pub pbr_metallic_roughness: Option<BaseColour>,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct BaseColour {
    pub base_color_texture: Option<TextureReference>,
}

/// Which texture, on which set of texture coordinates.
#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct TextureReference {
    pub index: usize,
    #[serde(default)]
    pub tex_coord: usize,
    pub extensions: Option<serde::de::IgnoredAny>,
}

#[derive(Deserialize)]
pub(super) struct TextureEntry {
    pub source: Option<usize>,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct Image {
    pub uri: Option<String>,
    pub mime_type: Option<String>,
    pub buffer_view: Option<usize>,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct Accessor {
    pub buffer_view: Option<usize>,
    #[serde(default)]
    pub byte_offset: usize,
    pub component_type: u32,
    #[serde(default)]
    pub normalized: bool,
    pub count: usize,
    #[serde(rename = "type")]
    pub shape: String,
    pub sparse: Option<Sparse>,
}

/// Values that replace some of an accessor's.
#[derive(Deserialize)]
pub(super) struct Sparse {
    pub count: usize,
    pub indices: SparseIndices,
    pub values: SparseValues,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct SparseIndices {
    pub buffer_view: usize,
    #[serde(default)]
    pub byte_offset: usize,
    pub component_type: u32,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct SparseValues {
    pub buffer_view: usize,
    #[serde(default)]
    pub byte_offset: usize,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct BufferView<'a> {
    pub buffer: usize,
    #[serde(default)]
    pub byte_offset: usize,
    pub byte_length: usize,
    pub byte_stride: Option<usize>,
    #[serde(borrow)]
    pub extensions: Option<&'a RawValue>,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(super) struct Buffer {
    pub byte_length: usize,
    pub uri: Option<String>,
}

/// Required extensions that leave positions and triangles as they are, or that the reader follows.
const HARMLESS: [&str; 6] =
    ["KHR_mesh_quantization", "KHR_materials_", "KHR_texture_", "EXT_texture_", "KHR_lights_", "KHR_xmp"];

/// Entries are parsed again at each use. A hostile file names a long entry often: the time it takes must stay within
/// a multiple of its length.
const MOST_REPEATS: usize = 64;
const ALWAYS_ALLOWED: usize = 1 << 20;

impl<'a> Document<'a> {
    pub fn parse(json: &'a [u8]) -> Result<Self, Fault> {
        let document: Self =
            serde_json::from_slice(json).map_err(|error| Fault::at("its JSON", error.to_string()))?;
        document.work.set(json.len().saturating_mul(MOST_REPEATS).saturating_add(ALWAYS_ALLOWED));
        let version = document.asset()?.version;
        if !version.starts_with("2.") {
            let problem = format!("is `{version}`: only glTF 2.0 is read, convert the file to it");
            return Err(Fault::at("asset.version", problem));
        }
        let harmless = |name: &str| HARMLESS.iter().any(|start| name.starts_with(start));
        match document.extensions_required.iter().find(|name| !harmless(name)) {
            Some(name) => {
                let problem = format!("names `{name}`, which is not supported: save the file without it");
                Err(Fault::at("extensionsRequired", problem))
            }
            None => Ok(document),
        }
    }

    pub fn asset(&self) -> Result<Asset, Fault> {
        let asset = self
            .asset
            .ok_or_else(|| Fault::at("its JSON", "has no `asset`: this is no glTF 2.0 document"))?;
        parsed(asset, "asset")
    }

    /// The nodes that the default scene begins with. Without scenes: those that are no other node's child.
    pub fn roots(&self) -> Result<Vec<usize>, Fault> {
        if self.scenes.is_empty() {
            return self.parentless();
        }
        let scene: Scene = self.entry(&self.scenes, "scenes", self.scene.unwrap_or(0))?;
        Ok(scene.nodes)
    }

    fn parentless(&self) -> Result<Vec<usize>, Fault> {
        let mut has_parent = vec![false; self.nodes.len()];
        for index in 0..self.nodes.len() {
            for child in self.node(index)?.children {
                if let Some(flag) = has_parent.get_mut(child) {
                    *flag = true;
                }
            }
        }
        Ok((0..self.nodes.len()).filter(|&index| !has_parent[index]).collect())
    }

    pub fn node_count(&self) -> usize {
        self.nodes.len()
    }

    pub fn mesh_count(&self) -> usize {
        self.meshes.len()
    }

    pub fn buffer_count(&self) -> usize {
        self.buffers.len()
    }

    pub fn node(&self, index: usize) -> Result<Node, Fault> {
        self.entry(&self.nodes, "nodes", index)
    }

    pub fn mesh(&self, index: usize) -> Result<Mesh, Fault> {
        self.entry(&self.meshes, "meshes", index)
    }

    pub fn accessor(&self, index: usize) -> Result<Accessor, Fault> {
        self.entry(&self.accessors, "accessors", index)
    }

    pub fn buffer_view(&self, index: usize) -> Result<BufferView<'a>, Fault> {
        self.entry(&self.buffer_views, "bufferViews", index)
    }

    /// The text of an accessor's entry.
    pub fn accessor_text(&self, index: usize) -> Option<&'a RawValue> {
        self.accessors.get(index).copied()
    }

    /// The text of a buffer's entry.
    pub fn buffer_text(&self, index: usize) -> Option<&'a RawValue> {
        self.buffers.get(index).copied()
    }

    pub fn material(&self, index: usize) -> Result<Material, Fault> {
        self.entry(&self.materials, "materials", index)
    }

    pub fn texture(&self, index: usize) -> Result<TextureEntry, Fault> {
        self.entry(&self.textures, "textures", index)
    }

    pub fn image(&self, index: usize) -> Result<Image, Fault> {
        self.entry(&self.images, "images", index)
    }

    pub fn buffer(&self, index: usize) -> Result<Buffer, Fault> {
        self.entry(&self.buffers, "buffers", index)
    }

    fn entry<T: Deserialize<'a>>(&self, list: &[&'a RawValue], name: &str, index: usize) -> Result<T, Fault> {
        let place = format!("{name}[{index}]");
        let raw = list.get(index).ok_or_else(|| {
            Fault::at(&place, format!("is named, but the file has {}, counted from 0", list.len()))
        })?;
        let work = self.work.get().checked_sub(raw.get().len());
        self.work.set(
            work.ok_or_else(|| Fault::at(&place, "is named too often: merge the scene's meshes into one"))?,
        );
        parsed(raw, &place)
    }
}

fn parsed<'a, T: Deserialize<'a>>(raw: &'a RawValue, place: &str) -> Result<T, Fault> {
    serde_json::from_str(raw.get()).map_err(|error| Fault::at(place, error.to_string()))
}
