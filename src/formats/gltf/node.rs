//! The hierarchy of nodes.

use gltf::json::{self, Index, Root};

use super::choice::Choice;
use super::document::Document;
use super::extensions::node::Visibility;
use super::mesh::Shaping;
use super::pose::is_flat;
use super::{GltfNode, Import};
use crate::error::LoadError;
use crate::world::Transform;

/// A node to be visited.
struct PendingNode {
    number: usize,
    /// The index of its parent among the nodes found.
    parent: Option<usize>,
    /// True if its ancestors are visible.
    visible: bool,
}

impl Import<'_> {
    /// Returns the nodes of a scene; parents precede their children.
    pub(super) fn nodes(&mut self, roots: Vec<usize>) -> Result<Vec<GltfNode>, LoadError> {
        let all = &self.document.root.nodes;
        let mut found: Vec<GltfNode> = Vec::new();
        // Uses an explicit stack: files may be nested more deeply than the call stack allows.
        let first = |number| PendingNode { number, parent: None, visible: true };
        let mut stack: Vec<PendingNode> = roots.into_iter().rev().map(first).collect();
        while let Some(PendingNode { number, parent, mut visible }) = stack.pop() {
            let Some(source) = all.get(number) else { continue };
            let at = format!("/nodes/{number}");
            let (transform, local) = self.local(number)?;
            if is_flat(&local) {
                self.losses.flat_nodes += 1;
                continue;
            }
            let extensions = source.extensions.as_ref().map(|extensions| &extensions.others);
            let read: Option<Visibility> = self.document.extension(extensions, "KHR_node_visibility", &at);
            visible &= read.is_none_or(|read| read.visible);
            let place = found.len();
            found.push(self.node(source, &at, parent, transform, visible));
            if visible {
                self.meshes_of(number, source, place, &mut found)?;
            }
            let children = source.children.as_deref().unwrap_or_default();
            let child = |child: &Index<json::Node>| PendingNode {
                number: child.value(),
                parent: Some(place),
                visible,
            };
            stack.extend(children.iter().rev().map(child));
        }
        Ok(found)
    }

    /// Creates a node without its mesh.
    fn node(
        &mut self,
        source: &json::Node,
        at: &str,
        parent: Option<usize>,
        transform: Transform,
        visible: bool,
    ) -> GltfNode {
        let camera = source.camera.and_then(|index| self.camera(index, &format!("{at}/camera")));
        let light = if visible { self.light(source, at) } else { None };
        let own = source.name.clone().filter(|name| !name.is_empty());
        if let (None, Some(index)) = (self.aspect, source.camera) {
            self.aspect = self.aspect_of(index);
        }
        let (camera, camera_name) = camera.unzip();
        let (light, light_name) = light.unzip();
        let name = own.or(camera_name.flatten()).or(light_name.flatten());
        GltfNode { parent, name, transform, mesh: None, light, camera }
    }

    /// Adds a node's mesh: once, once per instance, or deformed by its joints.
    fn meshes_of(
        &mut self,
        number: usize,
        source: &json::Node,
        place: usize,
        found: &mut Vec<GltfNode>,
    ) -> Result<(), LoadError> {
        let Some(index) = source.mesh else { return Ok(()) };
        let at = format!("/nodes/{number}");
        let moved = self.moved.get(&number).and_then(|moved| moved.weights.clone());
        let weights = moved.or_else(|| source.weights.clone());
        let mut shaping = Shaping { weights: weights.as_deref(), ..Shaping::default() };
        let another = |parent, transform, mesh| GltfNode {
            parent,
            name: None,
            transform,
            mesh: Some(mesh),
            light: None,
            camera: None,
        };
        let joints = source.skin.map(|skin| self.joints(skin, &format!("{at}/skin"))).transpose()?;
        if let Some(joints) = joints.flatten() {
            // The joints place the mesh; the node's own transform is ignored.
            shaping.joints = Some((number, &joints));
            if let Some(mesh) = self.mesh(index, shaping, &format!("{at}/mesh"))? {
                found.push(another(None, Transform::IDENTITY, mesh));
            }
            return Ok(());
        }
        let Some(mesh) = self.mesh(index, shaping, &format!("{at}/mesh"))? else { return Ok(()) };
        let Some(instances) = self.instances(source, &at)? else {
            found[place].mesh = Some(mesh);
            return Ok(());
        };
        for (transform, local) in instances {
            if is_flat(&local) {
                self.losses.flat_nodes += 1;
                continue;
            }
            found.push(another(Some(place), transform, mesh));
        }
        Ok(())
    }
}

/// Returns the parent of each node. Errors: a child that does not exist, has two parents, or is its own ancestor.
pub(super) fn parents(document: &Document) -> Result<Vec<Option<usize>>, LoadError> {
    let nodes = &document.root.nodes;
    let mut parents: Vec<Option<usize>> = vec![None; nodes.len()];
    for (number, node) in nodes.iter().enumerate() {
        for (place, child) in node.children.iter().flatten().enumerate() {
            let at = || format!("/nodes/{number}/children/{place}");
            document.get(nodes, *child, format_args!("{}", at()), "node")?;
            let child = child.value();
            if let Some(other) = parents[child] {
                return Err(document.error(at(), format!("node {child} already has the parent {other}")));
            }
            parents[child] = Some(number);
        }
    }
    // Walk up from every node, until there is no parent or the node was visited before.
    let mut met_from = vec![usize::MAX; nodes.len()];
    for start in 0..nodes.len() {
        let mut at = Some(start);
        while let Some(node) = at.filter(|node| met_from[*node] != start) {
            if met_from[node] != usize::MAX {
                break;
            }
            met_from[node] = start;
            at = parents[node];
        }
        if at.is_some_and(|node| met_from[node] == start) {
            return Err(document.error(format!("/nodes/{start}"), "a node cannot be its own ancestor"));
        }
    }
    Ok(parents)
}

/// The scenes of a file, as they are chosen by name or number.
pub(super) fn choice(root: &Root) -> Choice {
    Choice::of("scene", root.scenes.iter().map(|scene| scene.name.as_deref()))
}

/// Returns the scene to show: the one requested by name or number, else the file's default scene, else its first. None
/// if the file has no scenes.
pub(super) fn scene(
    document: &Document,
    asked: Option<&str>,
) -> Result<Option<Index<json::Scene>>, LoadError> {
    let Root { scene, scenes, .. } = &document.root;
    let Some(asked) = asked else {
        let of_file = scene.filter(|index| {
            document.find(scenes, *index, "/scene", "scene", "the first one counts").is_some()
        });
        return Ok(of_file.or((!scenes.is_empty()).then(|| Index::new(0))));
    };
    let found = choice(&document.root).find(asked);
    found.map(|number| Some(Index::new(number as u32))).map_err(|reason| document.error("/scenes", reason))
}

/// Returns the root nodes of a scene; without a scene, all nodes that have no parent.
pub(super) fn roots(
    document: &Document,
    scene: Option<Index<json::Scene>>,
    parents: &[Option<usize>],
) -> Result<Vec<usize>, LoadError> {
    let Root { scenes, nodes, .. } = &document.root;
    let Some(index) = scene else {
        return Ok((0..nodes.len()).filter(|node| parents[*node].is_none()).collect());
    };
    let scene = document.get(scenes, index, "/scene", "scene")?;
    let mut roots = Vec::with_capacity(scene.nodes.len());
    let mut taken = vec![false; nodes.len()];
    for (place, root) in scene.nodes.iter().enumerate() {
        let at = format!("/scenes/{}/nodes/{place}", index.value());
        document.get(nodes, *root, &at, "node")?;
        let root = root.value();
        if let Some(parent) = parents[root] {
            return Err(document.error(at, format!("node {root} is a child of node {parent}, not a root")));
        }
        if std::mem::replace(&mut taken[root], true) {
            document.mend(at, format_args!("node {root} is there twice: it is shown once"));
            continue;
        }
        roots.push(root);
    }
    Ok(roots)
}
