//! Looking things up in a rule set, and its digest.

use super::{Label, Param, PrimitiveId, Rules, Tree, TreeScope};
use crate::base::hands::Side;

impl Rules {
    /// The name of a label as it is shown: `Grasp`, `MainGrasp(left)`.
    pub fn label_name(&self, label: Label) -> String {
        let name = self.primitives.get(label.primitive.index()).map_or("?", |primitive| primitive.name.as_str());
        match label.side {
            Some(side) => format!("{name}({side})"),
            None => name.to_string(),
        }
    }

    /// The names of all labels that a leaf may give: of a sided primitive one for each side.
    pub fn label_names(&self) -> impl Iterator<Item = String> {
        self.primitives.iter().zip(0..).flat_map(move |(primitive, at)| {
            let sides = if primitive.sided { Side::BOTH.map(Some).to_vec() } else { vec![None] };
            sides.into_iter().map(move |side| self.label_name(Label { primitive: PrimitiveId(at), side }))
        })
    }

    /// The primitive with this name.
    pub fn primitive(&self, name: &str) -> Option<PrimitiveId> {
        let at = self.primitives.iter().position(|primitive| primitive.name == name)?;
        u32::try_from(at).ok().map(PrimitiveId)
    }

    /// The param with this name.
    pub fn param(&self, name: &str) -> Option<&Param> {
        self.params.iter().find(|param| param.name == name)
    }

    /// The tree with this scope.
    pub fn tree(&self, scope: TreeScope) -> Option<&Tree> {
        self.trees.iter().find(|tree| tree.scope == scope)
    }

    /// A stable hash of all texts and of all values of params, as 16 hexadecimal digits (FNV-1a, 64 bits).
    ///
    /// It does not depend on where the files lie.
    pub fn digest(&self) -> String {
        let texts = self.sources.files.iter().flat_map(|source| source.text.bytes().chain([0]));
        let params = self.params.iter().flat_map(|param| param.name.bytes().chain(param.value.to_bits().to_le_bytes()));
        let hash = texts
            .chain(params)
            .fold(0xcbf2_9ce4_8422_2325_u64, |hash, byte| (hash ^ u64::from(byte)).wrapping_mul(0x0000_0100_0000_01b3));
        format!("{hash:016x}")
    }
}
