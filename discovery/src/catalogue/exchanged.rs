//! Places between two balances of one kind: what comes into the one is taken from the other, a leak across a piston, a bridge of heat.
//!
//! What passes is driven by a difference: of the variables that the balances store, or of the potentials of the connectors where adapters
//! stand.  The same amount must be added to the one equation and taken from the other, so that an equation that is solved for its rate
//! makes no place where it does not say how much is stored (`der(T) = P - k*T`, and not `der(T) = (P - k*T)/C`).  Where one equation follows the other variable and not the other way
//! round (a lag, a tank below another one), nothing comes back, and nothing is exchanged.

use std::sync::Arc;

use crate::catalogue::Site;
use crate::catalogue::door::{Door, End, Law};
use crate::variant::Workshop;

/// Beyond so many balances of one kind nothing is tried between two of them: there are as many pairs as the square of that.
const MOST: usize = 8;
/// What drives an exchange: by how much more the first of two balances has than the second.
const DIFFERENCE: &str = "d";
/// What an exchange gives; under the same name its sizes ask for what changes the two balances.
const EXCHANGED: &str = "y";
/// Units of amounts, whose differences drive nothing.
const AMOUNTS: [&str; 5] = ["m3", "kg", "J", "mol", "C"];

/// A balance that has a place.
pub(super) struct Store {
    /// The place of its own.
    pub(super) site: Site,
    /// What drives a flow out of it: the variable that is stored, or the potential of a connector.
    pub(super) driver: String,
    /// The unit of that, and of the equation.
    pub(super) units: [Arc<str>; 2],
    /// The term that stores.
    pub(super) storage: String,
    /// The equation is solved for the rate alone.
    pub(super) is_bare: bool,
    /// Full names in its equation.
    pub(super) mentions: Vec<String>,
}

impl Store {
    /// True if an equation of a library is opened for it.
    pub(super) fn is_of_library(&self, workshop: &Workshop<'_>) -> bool {
        self.site.door.openings().any(|opening| workshop.own_text(&opening.file).is_none())
    }
}

/// The places between balances of the kind `of`, which are called `id`, and sentences on what cannot be one.
pub(super) fn between(stores: &[Store], (of, id): (&str, &str)) -> (Vec<Site>, Vec<String>) {
    let own: Vec<&Store> = stores.iter().filter(|store| *store.site.id == *of).collect();
    if own.len() > MOST {
        let sentence = format!(
            "what may pass between two balances (`{id}`) is not tried: of more than {MOST} (there are {}) not every pair can be",
            own.len()
        );
        return (Vec::new(), vec![sentence]);
    }
    if own.len() < 2 {
        return (Vec::new(), Vec::new());
    }
    let (bare, own): (Vec<&Store>, Vec<&Store>) = own.into_iter().partition(|store| is_solved(store));
    let (amounts, can): (Vec<&Store>, Vec<&Store>) =
        own.into_iter().partition(|store| AMOUNTS.contains(&&*store.units[0]));
    let not_tried = |stores: &[&Store], why: &dyn Fn(&Store) -> String| {
        let paths: Vec<&str> = stores.iter().map(|store| store.site.path.as_str()).collect();
        let first = stores.first()?;
        Some(format!("what may pass between {} and others is not tried: {}", paths.join(", "), why(first)))
    };
    let of_bare = not_tried(&bare, &|store| {
        let rate = store.storage.trim_start_matches(['-', '+', ' ']);
        format!(
            "an equation that is solved for the rate does not say how much is stored; write it with the capacity, mass or area, as C*{rate} = ..., or give \
             all in it units"
        )
    });
    let of_amounts =
        not_tried(&amounts, &|store| format!("differences of amounts (here in {}) drive nothing", store.units[0]));
    let mut found = Vec::new();
    for (k, one) in can.iter().enumerate() {
        let others =
            can[k + 1..].iter().filter(|other| alike(one, other) && follows(one, other) == follows(other, one));
        found.extend(others.filter_map(|other| exchange(id, (one, other))));
    }
    (found, of_bare.into_iter().chain(of_amounts).collect())
}

/// The equation that a term would come into is solved for the rate.
fn is_solved(store: &Store) -> bool {
    store.is_bare && matches!(store.site.door.ends(), [End::Equation { .. }])
}

/// Both have the same units, as far as these are known: an exchange of a level with a pressure has no law.
fn alike(one: &Store, other: &Store) -> bool {
    let same = |(a, b): (&Arc<str>, &Arc<str>)| {
        let scale = |unit: &Arc<str>| if **unit == *"degC" { Arc::from("K") } else { unit.clone() };
        a.is_empty() || b.is_empty() || scale(a) == scale(b)
    };
    one.units.iter().zip(&other.units).all(same)
}

/// The equation of the first has what the second stores.
fn follows(one: &Store, other: &Store) -> bool {
    one.mentions.iter().any(|name| *name == other.site.path || *name == other.driver)
}

/// The place that two balances are.
fn exchange(id: &str, (one, other): (&Store, &Store)) -> Option<Site> {
    let end = |store: &Store| match &store.site.door {
        Door::Balance { end, .. } => Some(end.clone()),
        _ => None,
    };
    let ends = Box::new([end(one)?, end(other)?]);
    let difference = format!("{} - {}", one.driver, other.driver);
    // Either may be at rest in the base model.
    let changed = format!("abs({}) + abs({})", one.storage, other.storage);
    let (a, b) = (&one.site.path, &other.site.path);
    let words = one.site.words.split(':').next().unwrap_or_default();
    Some(Site {
        id: id.into(),
        path: format!("{a} and {b}"),
        words: Arc::from(format!("{words}: between those of {a} and {b}")),
        channel: None,
        file: one.site.file.clone(),
        line: one.site.line,
        array: None,
        scales: vec![(DIFFERENCE.into(), difference.clone()), (EXCHANGED.into(), changed)],
        door: Door::Exchange {
            ends,
            stored: [a.clone(), b.clone()],
            law: Law { inputs: vec![(DIFFERENCE, Some(difference))], output: EXCHANGED },
        },
    })
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use hyd_compiler::{Act, Opening};

    use super::{MOST, Store, between};
    use crate::catalogue::Site;
    use crate::catalogue::door::{Door, End, Law};
    use crate::elements::At;

    /// A body whose equation has these names.
    fn body(name: &str, unit: &str, storage: &str, mentions: &[&str]) -> Store {
        let opening = Opening {
            file: "m.mo".into(),
            line: 1,
            equation: storage.into(),
            name: "more".into(),
            words: String::new(),
            factor: String::new(),
            act: Act::Adds,
            elements: None,
        };
        let end = End::Equation { opening, path: "".into(), is_reversed: false, element: At::default() };
        let law = Law { inputs: Vec::new(), output: "Q" };
        Store {
            site: Site {
                id: "heat".into(),
                path: name.into(),
                words: "balance of heat: of it".into(),
                channel: None,
                file: "m.mo".into(),
                line: 1,
                door: Door::Balance { end, law },
                scales: Vec::new(),
                array: None,
            },
            driver: name.into(),
            units: [Arc::from(unit), Arc::from("")],
            storage: storage.into(),
            is_bare: storage.starts_with("der("),
            mentions: mentions.iter().map(|name| name.to_string()).collect(),
        }
    }

    fn paths(stores: &[Store]) -> (Vec<String>, Vec<String>) {
        let (sites, said) = between(stores, ("heat", "heat_pair"));
        (sites.into_iter().map(|site| site.path).collect(), said)
    }

    #[test]
    fn like_balances_make_pairs() {
        let [a, b, c] =
            [("a", "K"), ("b", "degC"), ("c", "")].map(|(name, unit)| body(name, unit, "C*der(x)", &[name]));
        let (found, said) = paths(&[a, b, c, body("p", "Pa", "C*der(p)", &["p"])]);
        assert_eq!((found, said.len()), (["a and b", "a and c", "b and c", "c and p"].map(String::from).to_vec(), 0));
    }

    #[test]
    fn a_follower_gets_nothing_back() {
        let sensor = body("m", "", "tau*der(m)", &["m", "a"]);
        assert_eq!(paths(&[body("a", "", "C*der(a)", &["a"]), sensor]).0, Vec::<String>::new());
        // Both have the other one: they exchange something already, and may more.
        let two = [body("a", "", "C*der(a)", &["a", "b"]), body("b", "", "C*der(b)", &["a", "b"])];
        assert_eq!(paths(&two).0, ["a and b"]);
    }

    #[test]
    fn rates_and_amounts_are_said_to_exchange_nothing() {
        let (found, said) = paths(&[
            body("a", "K", "der(a)", &["a"]),
            body("b", "K", "C*der(b)", &["b"]),
            body("c", "K", "der(c)", &["c"]),
            body("e", "J", "k*der(e)", &["e"]),
        ]);
        assert!(found.is_empty() && said.len() == 2, "{found:?} {said:?}");
        assert!(said[0].contains("between a, c and others") && said[0].contains("C*der(a) = ..."), "{said:?}");
        assert!(said[1].contains("between e and others") && said[1].contains("in J"), "{said:?}");
    }

    #[test]
    fn too_many_are_said_to_be() {
        let all: Vec<Store> = (0..=MOST).map(|k| body(&format!("x{k}"), "", "C*der(x)", &[])).collect();
        let (found, said) = paths(&all);
        assert!(found.is_empty() && said.len() == 1 && said[0].contains("there are 9"), "{said:?}");
    }
}
