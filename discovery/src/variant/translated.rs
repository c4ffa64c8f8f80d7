//! A translated model with its channels, and the same model once more where rounding errors grow along its loops.

use std::sync::Arc;

use hyd_compiler::{Compilation, CompiledModel, Files, FlatModel, ForeignBlock, Options, with_whole_loops};

/// Channels are variables of this name and a number, with a number before where a text has the name already.
const CHANNEL: &str = "hyd_channel";

/// A translated model whose channels are variables of their own.
pub struct Translated {
    /// The code.
    pub model: Arc<CompiledModel>,
    /// How the variables of the channels are called.
    pub channels: ChannelNames,
    /// Names of the inputs of type Real at the top of the model.
    pub inputs: Vec<String>,
    /// Warnings of the translation, one sentence each.
    pub warnings: Vec<String>,
    /// Blocks that are units of other tools.
    pub(crate) blocks: Arc<[ForeignBlock]>,
    flat: Option<Arc<FlatModel>>,
    files: Files,
    options: Options,
}

/// Names of the variables that channels are: none of them stands in a text of the user's.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct ChannelNames(String);

impl ChannelNames {
    /// Names that begin like nothing in these texts.
    pub(crate) fn free<'t>(texts: impl Iterator<Item = &'t str> + Clone) -> Self {
        let numbered = (2_u32..).map(|k| format!("{CHANNEL}{k}_"));
        let all = std::iter::once(format!("{CHANNEL}_")).chain(numbered);
        // Texts are finite, and there is a name for every number.
        let found = all.map(Self).find(|names| !names.stands_in(texts.clone()));
        found.unwrap_or_else(|| Self(String::new()))
    }

    /// True if one of these texts has something that begins like these names.
    pub(crate) fn stands_in<'t>(&self, mut texts: impl Iterator<Item = &'t str>) -> bool {
        texts.any(|text| text.contains(&self.0))
    }

    /// The variable of a channel.
    pub fn of(&self, channel: usize) -> String {
        format!("{}{channel}", self.0)
    }

    /// True for the variables of channels.
    pub fn has(&self, name: &str) -> bool {
        name.starts_with(&self.0)
    }
}

impl Translated {
    /// What a compilation without errors has made; none if it made no code.
    pub(crate) fn new(
        compilation: Compilation,
        (channels, warnings): (ChannelNames, Vec<String>),
        options: Options,
    ) -> Option<Self> {
        let model = compilation.model?;
        let inputs = compilation.flat.as_deref().map(FlatModel::real_inputs).unwrap_or_default();
        let blocks: Arc<[ForeignBlock]> =
            compilation.flat.as_deref().map_or_else(|| [].into(), |flat| flat.foreign.clone().into());
        // Only what loops are made whole of is kept.
        let flat = compilation.flat.filter(|_| model.payload().has_torn_loops());
        Some(Self { model, channels, inputs, warnings, blocks, flat, files: compilation.files, options })
    }

    /// Units of other tools in the model.
    pub fn blocks(&self) -> &[ForeignBlock] {
        &self.blocks
    }

    /// Units lie where these blocks say: a text that is put together of others lies in none of their folders.
    pub(crate) fn keep_units(&mut self, original: &[ForeignBlock]) {
        let kept = self.blocks.iter().map(|block| {
            let known = original.iter().find(|known| known.path == block.path && known.file == block.file);
            let written_in = known.map_or(&block.written_in, |known| &known.written_in).clone();
            ForeignBlock { written_in, ..block.clone() }
        });
        self.blocks = kept.collect();
    }

    /// The model with all variables of loops as unknowns of the solver; none where no loop is computed one variable after the other,
    /// or where that cannot be translated.
    pub(crate) fn with_whole_loops(&self) -> Option<Self> {
        let model = with_whole_loops(self.flat.as_ref()?, &self.files, &self.options).ok()?;
        let (channels, options) = (self.channels.clone(), self.options.clone());
        let (inputs, blocks, warnings) = (self.inputs.clone(), self.blocks.clone(), self.warnings.clone());
        Some(Self { model, channels, inputs, warnings, blocks, flat: None, files: self.files.clone(), options })
    }
}

#[cfg(test)]
mod tests {
    use super::ChannelNames;

    #[test]
    fn names_of_channels_stand_in_no_text() {
        let free = |texts: &[&str]| ChannelNames::free(texts.iter().copied()).of(0);
        assert_eq!(free(&[]), "hyd_channel_0");
        assert_eq!(free(&["Real x;", "Real hyd_channel_7;"]), "hyd_channel2_0");
        assert_eq!(free(&["Real hyd_channel2_x;", "Real hyd_channel_7;"]), "hyd_channel3_0");
    }
}
