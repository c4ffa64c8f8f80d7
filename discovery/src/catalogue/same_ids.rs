//! Effects of several libraries that have one id: they go by the names of their classes.

use std::collections::BTreeMap;
use std::sync::Arc;

use crate::catalogue::Candidate;

/// Gives effects of one id the full names of their classes as ids, also where others name them, and says so.
pub(crate) fn tell_apart(candidates: &mut [Candidate]) -> Vec<String> {
    let mut classes: BTreeMap<Arc<str>, Vec<String>> = BTreeMap::new();
    for Candidate { effect, .. } in candidates.iter() {
        let known = classes.entry(effect.id.clone()).or_default();
        if !known.contains(&effect.class) {
            known.push(effect.class.clone());
        }
    }
    classes.retain(|_, classes| classes.len() > 1);
    if classes.is_empty() {
        return Vec::new();
    }
    let renamed = |list: &[Arc<str>]| -> Vec<Arc<str>> {
        let names = |id: &Arc<str>| match classes.get(id) {
            Some(classes) => classes.iter().map(|class| class.as_str().into()).collect(),
            None => vec![id.clone()],
        };
        list.iter().flat_map(names).collect()
    };
    for Candidate { effect, .. } in candidates.iter_mut() {
        let own = Arc::make_mut(effect);
        if classes.contains_key(&own.id) {
            own.id = own.class.as_str().into();
        }
        for list in [&mut own.rivals, &mut own.excludes, &mut own.refines] {
            *list = renamed(list);
        }
    }
    let told = classes.iter().map(|(id, classes)| {
        let names: Vec<String> = classes.iter().map(|class| format!("`{class}`")).collect();
        format!(
            "the effects {} are {} called `{id}` and go by the names of their classes; give one another id, or name one in `without` of the study",
            names.join(" and "),
            if names.len() == 2 { "both" } else { "all" }
        )
    });
    told.collect()
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use hyd_compiler::inquiry::Note;

    use super::{Candidate, tell_apart};
    use crate::catalogue::{effects, tests::with_range};

    #[test]
    fn effects_of_one_id_go_by_their_classes_everywhere() {
        let of = |class: &str, id: &str, rival: &str| {
            let mut own = with_range(&[0.5, 2.0]);
            own.name = class.to_string();
            if let Note::Record(all) = &mut own.note
                && let Note::Record(entries) = &mut all[0].1
            {
                entries[0].1 = Note::Text(id.into());
                entries.push(("refines".into(), Note::Text(rival.into())));
            }
            let effect = effects(&[own]).unwrap().remove(0);
            Candidate { effect, sites: Vec::new() }
        };
        let mut all =
            vec![of("A.Seep", "seeping", "other"), of("B.Seep", "seeping", "none"), of("B.Other", "other", "seeping")];
        let told = tell_apart(&mut all);
        assert!(
            told.len() == 1 && told[0].starts_with("the effects `A.Seep` and `B.Seep` are both called `seeping`"),
            "{told:?}"
        );
        let found: Vec<(&str, Vec<&str>)> =
            all.iter().map(|own| (&*own.effect.id, own.effect.refines.iter().map(|id| &**id).collect())).collect();
        assert_eq!(found, [("A.Seep", vec!["other"]), ("B.Seep", vec!["none"]), ("other", vec!["A.Seep", "B.Seep"])]);
        assert!(tell_apart(&mut all).is_empty());
    }
}
