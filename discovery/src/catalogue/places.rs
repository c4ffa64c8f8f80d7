//! Places in a model that declares none: its balances and its channels.
//!
//! A balance ([`hyd_compiler::balances`]) is told by units what it is of: by that of the equation, else by that of the variable that
//! is stored.  Where a model has no units, a second derivative makes a balance of forces, and else the name of the variable decides as
//! engineers choose names.  An effect comes in as a term of an equation of the model's file, or, where the equation is that of a
//! component of a library, by an adapter on the component's connector.  Every channel is the place of a measuring chain; for commands to
//! valves and drives see [`super::commands`].

use std::sync::Arc;

use hyd_compiler::{Act, Balance, Element, Elements, MOST_ELEMENTS, Opening, Scaled, balances, opened};
use hyd_system::{Tables, VariableInfo};

use crate::catalogue::commands::commands;
use crate::catalogue::door::{Door, End, Law};
use crate::catalogue::exchanged::{Store, between};
use crate::catalogue::naming::{outside, shared};
use crate::catalogue::{Effect, SCALE, Site};
use crate::data::ChannelInfo;
use crate::elements::At;
use crate::terms::law::{EQUATION, place_id, site_of};
use crate::variant::Workshop;
use crate::{Fault, Setup};

/// Id of the place that a channel is.
const SENSOR: &str = "sensor";
/// Id of the place that a channel is which hears another one.
const PAIR: &str = "sensor_pair";
/// Beyond so many channels pairs of them are not tried: there are as many as the square of that.
const MOST_PAIRED: usize = 8;
/// Id of the place that the trigger of a unit is.
const MOVED: &str = "trigger_moved";

/// A kind of balance.
struct Kind {
    /// Id of its places, which effects name in `at`.
    id: &'static str,
    /// Words for reports.
    words: &'static str,
    /// Units of the equation.
    units: &'static [&'static str],
    /// Units of what is stored.
    stored: &'static [&'static str],
    /// How names of what is stored begin where there are no units.
    names: &'static [&'static str],
    /// Input of a law that is what is stored, the one that is the term that stores, and the output.
    law: (&'static str, &'static str, &'static str),
    /// Id of the places that two of them are.
    pair: Option<&'static str>,
    /// Adapter, its connector, and what variables of connectors that it fits are called: flow and potential.
    adapter: Option<(&'static str, &'static str, [&'static str; 2])>,
    /// The potential of such a connector that drives flows, where it is not what is stored.
    potential: Option<&'static str>,
}

const KINDS: [Kind; 5] = [
    Kind {
        id: "force",
        words: "balance of forces",
        units: &["N", "N.m", "kg.m/s2", "kg.m2/s2"],
        stored: &["m/s", "rad/s"],
        names: &["v", "w", "omega", "speed"],
        law: ("v", "F", "F"),
        pair: Some("force_pair"),
        adapter: Some(("Hyd.Places.ForceAt", "flange", ["f", "s"])),
        potential: None,
    },
    Kind {
        id: "voltage",
        words: "voltages of a loop",
        units: &["V"],
        stored: &["A"],
        names: &["i", "current"],
        law: ("i", "u_L", "u"),
        pair: None,
        adapter: None,
        potential: None,
    },
    Kind {
        id: "current",
        words: "currents of a node",
        units: &["A"],
        stored: &["V"],
        names: &["u", "volt"],
        law: ("u", "i_C", "i"),
        pair: Some("current_pair"),
        adapter: None,
        potential: None,
    },
    Kind {
        id: "heat",
        words: "balance of heat",
        units: &["W", "J/s"],
        stored: &["K", "degC"],
        names: &["t", "temp", "theta"],
        law: ("T", "Q_C", "Q"),
        pair: Some("heat_pair"),
        adapter: Some(("Hyd.Places.HeatAt", "port", ["Q_flow", "T"])),
        potential: Some("T"),
    },
    // The last one takes what no other does.
    Kind {
        id: "flow",
        words: "balance of a vessel",
        units: &["m3/s", "kg/s"],
        stored: &["m", "m3", "Pa", "kg"],
        names: &["h", "level", "p", "vol"],
        law: ("h", "q_C", "q"),
        pair: Some("flow_pair"),
        adapter: Some(("Hyd.Places.FlowAt", "port", ["q", "p"])),
        potential: Some("p"),
    },
];

/// The places of a model that declares none, and sentences on what cannot be one; `asks` says whether any effect takes places of an id.
///
/// # Errors
/// When the base model cannot be translated.
pub(crate) fn found(
    setup: &Setup,
    workshop: &Workshop<'_>,
    asks: &dyn Fn(&str) -> bool,
) -> Result<(Vec<Site>, Vec<String>), Fault> {
    let base = setup.machine(workshop.translate(&[])?)?;
    let sites = workshop.injection_sites(&[], base.channel_names());
    let mut found: Vec<Site> = Vec::new();
    let mut stores: Vec<Store> = Vec::new();
    let mut sentences = Vec::new();
    for balance in balances(&sites) {
        let (own, sentence) = places(&balance, base.tables(), workshop, &found);
        for store in own {
            if found.iter().all(|known| known.path != store.site.path) {
                found.push(store.site.clone());
                // What stands between two equations of a library, potentials or only differences of them, is not known.
                if !store.is_of_library(workshop) {
                    stores.push(store);
                }
            }
        }
        sentences.extend(sentence);
    }
    written_out(&mut found);
    for (kind, pair) in KINDS.iter().filter_map(|kind| Some((kind, kind.pair?))).filter(|(_, pair)| asks(pair)) {
        let (sites, said) = between(&stores, (kind.id, pair));
        found.extend(sites);
        sentences.extend(said);
    }
    commands(&sites, base.tables(), workshop, &mut found);
    let moved = workshop.opaque.iter().map(|own| &own.moved).filter(|moved| !moved.is_empty());
    found.extend(moved.map(|moved| Site {
        id: MOVED.into(),
        path: "trigger".into(),
        words: "what moves with the trigger".into(),
        channel: None,
        file: workshop.study.as_str().into(),
        line: setup.study.line(&["shots", "trigger_moves"]),
        door: Door::Moved(moved.clone()),
        scales: Vec::new(),
        array: None,
    }));
    found.extend(setup.data.channels.iter().map(|channel| Site {
        id: SENSOR.into(),
        path: channel.name.clone(),
        words: channel.words.as_str().into(),
        channel: Some(channel.name.as_str().into()),
        file: workshop.study.as_str().into(),
        line: setup.study.line(&["channels", &channel.name]),
        door: Door::Channel { expression: channel.expression.clone(), heard: None },
        scales: vec![("u".into(), channel.expression.clone())],
        array: None,
    }));
    found.extend(pairs(setup, workshop));
    Ok((found, sentences))
}

/// From so many on, numbered variables (`T1`, `T2`, `T3`, or those of `wall1`, `wall2`, `wall3`) are taken for an array that is written out.
const FEWEST_NUMBERED: usize = 3;

/// Makes places of one kind whose variables differ in a number of their names only those of one array.
fn written_out(found: &mut [Site]) {
    let stem = |site: &Site| {
        let digits = site.path.rfind(|c: char| c.is_ascii_digit())?;
        let from = site.path[..digits].rfind(|c: char| !c.is_ascii_digit())? + 1;
        let is_subscript = site.path[..from].ends_with(['[', ',']);
        (!is_subscript && site.array.is_none())
            .then(|| (site.id.clone(), format!("{}#{}", &site.path[..from], &site.path[digits + 1..])))
    };
    let stems: Vec<_> = found.iter().map(stem).collect();
    for k in 0..found.len() {
        let Some(own) = &stems[k] else { continue };
        let members: Vec<usize> = (0..found.len()).filter(|&other| stems[other].as_ref() == Some(own)).collect();
        if members.len() >= FEWEST_NUMBERED && members[0] == k {
            let paths: Vec<&str> = members.iter().map(|&member| found[member].path.as_str()).collect();
            let array: Arc<str> = format!("of {}", paths.join(", ")).into();
            members.iter().for_each(|&member| found[member].array = Some(array.clone()));
        }
    }
}

/// Every channel that may hear another one; none where there are too many.
fn pairs(setup: &Setup, workshop: &Workshop<'_>) -> Vec<Site> {
    let channels = &setup.data.channels;
    if channels.len() > MOST_PAIRED {
        return Vec::new();
    }
    let all = channels.iter().flat_map(|own| channels.iter().map(move |other| (own, other)));
    let site = |(own, other): (&ChannelInfo, &ChannelInfo)| Site {
        id: PAIR.into(),
        path: format!("{} from {}", own.name, other.name),
        words: own.words.as_str().into(),
        channel: Some(own.name.as_str().into()),
        file: workshop.study.as_str().into(),
        line: setup.study.line(&["channels", &own.name]),
        door: Door::Channel { expression: own.expression.clone(), heard: Some(other.expression.clone()) },
        scales: vec![("u".into(), own.expression.clone()), ("v".into(), other.expression.clone())],
        array: None,
    };
    all.filter(|(own, other)| own.expression != other.expression).map(site).collect()
}

/// A sentence on pairs of channels that are not tried, where an effect asks for them.
pub(crate) fn unpaired(setup: &Setup, effects: &[Arc<Effect>]) -> Option<String> {
    let count = setup.data.channels.len();
    let asks = effects.iter().find(|effect| effect.at.iter().flatten().any(|id| **id == *PAIR))?;
    (count > MOST_PAIRED).then(|| {
        format!(
            "`{}` is not tried: of more than {MOST_PAIRED} channels (there are {count}) not every pair can be",
            asks.id
        )
    })
}

/// The places of a force that a model declares (`place(id = "force", scale = "mass.m*mass.a")`, at a component with the base
/// `Hyd.Places.PartialForce`) as places of laws: forces that are connected beside whatever stands there, as many as there are.
pub(crate) fn beside_declared(declared: &[Site]) -> Vec<Site> {
    let force = &KINDS[0];
    let Some((adapter, socket, _)) = force.adapter else { return Vec::new() };
    let own = declared.iter().filter(|site| *site.id == *force.id && site.door == Door::Component);
    let beside = own.map(|site| {
        let of = |name: &str| format!("{}.{name}", site.path);
        let (s, v, a) = (of("s"), of("v"), format!("der({})", of("v")));
        let typical =
            site.scales.iter().find(|(name, _)| name == SCALE).map(|(_, text)| (force.law.1.into(), text.clone()));
        let moving = [("s", &s), ("v", &v), ("a", &a)].map(|(name, text)| (name.to_string(), text.clone()));
        let inputs = vec![("s", Some(s)), ("v", Some(v)), ("a", Some(a))];
        let law = Law { inputs, output: force.law.2 };
        Site {
            scales: moving.into_iter().chain(typical).collect(),
            door: Door::Balance { end: End::Connector { connector: of(socket), adapter, socket }, law },
            ..site.clone()
        }
    });
    beside.collect()
}

/// The equations of the study's file that laws name as their places ([`crate::terms::law`]): each where that equation still stands.
///
/// # Errors
/// When the base model cannot be translated.
pub(crate) fn of_laws(effects: &[Arc<Effect>], setup: &Setup, workshop: &Workshop<'_>) -> Result<Vec<Site>, Fault> {
    let named = |effect: &&Arc<Effect>| effect.is_law && effect.at.iter().flatten().any(|id| id.starts_with(EQUATION));
    let laws: Vec<&Arc<Effect>> = effects.iter().filter(named).collect();
    if laws.is_empty() {
        return Ok(Vec::new());
    }
    let base = setup.machine(workshop.translate(&[])?)?;
    let sites = workshop.injection_sites(&[], base.channel_names());
    let own = sites.iter().filter(|site| site.refused.is_none() && workshop.own_text(&site.file).is_some());
    let mut found: Vec<Site> = Vec::new();
    for site in own {
        let id = place_id(&site.path, &site.text);
        let laws = laws.iter().filter(|law| law.at.iter().flatten().any(|at| **at == *id));
        let place = |law: &&Arc<Effect>| site_of((&site.path, &site.file, site.line, &site.text), &law.given, workshop);
        for place in laws.filter_map(place) {
            if !found.iter().any(|known| known.id == place.id && known.door == place.door) {
                found.push(place);
            }
        }
    }
    Ok(found)
}

/// The places that a balance is, one for each equation that its text gives, with what is known of them for what may pass between them and others; and a
/// sentence on why it is none, where a user may ask.
fn places(balance: &Balance, tables: &Tables, workshop: &Workshop<'_>, known: &[Site]) -> (Vec<Store>, Option<String>) {
    let equation = balance.site.text.trim_end_matches(';');
    if balance.site.count > MOST_ELEMENTS {
        let count = balance.site.count;
        let sentence =
            format!("nothing is added to `{equation}`: there are {count} such equations, more than {MOST_ELEMENTS}");
        return (Vec::new(), Some(sentence));
    }
    let mut opening = None;
    let mut found = Vec::new();
    for element in &balance.elements {
        match place(balance, element, (tables, workshop), (known, &mut opening)) {
            Ok(store) => found.extend(store),
            // What is said of one element holds for all.
            Err(sentence) => return (found, Some(sentence)),
        }
    }
    let count = balance.site.count;
    let sentence = (found.len() < count && count > 1).then(|| {
        let some = if found.is_empty() { String::new() } else { format!(" in {} of its {count} elements", count - found.len()) };
        format!("nothing is added to `{equation}`{some}: which element it is for is not clear, or no term can be let into that")
    });
    (found, sentence)
}

/// The place that one equation of a balance is; none if no effect can come in there.  `opening`: how something comes into the text, once it is known.
fn place(
    balance: &Balance,
    element: &Element,
    (tables, workshop): (&Tables, &Workshop<'_>),
    (known, opening): (&[Site], &mut Option<Opening>),
) -> Result<Option<Store>, String> {
    // What a name of the text is called in the model; one that stands for a constant is none of its variables.
    let full = |name: &str| {
        let names = element.names(name);
        names.iter().find(|own| tables.find(own).is_some()).or(names.first()).cloned().unwrap_or_else(|| name.into())
    };
    let state = full(&balance.state);
    let Some((variable, number)) = tables.find(&state) else { return Ok(None) };
    let unit = variable.unit.clone();
    let outside = |storage: &str, names: &[(usize, usize)]| outside(storage, names, &full, (tables, workshop));
    let (kind, scaled) = kind(balance, &unit, &|own| outside(&own.storage, &own.names).is_some());
    let (storage, names) = scaled.map_or((&balance.storage, &balance.names), |own| (&own.storage, &own.names));
    let equation = balance.site.text.trim_end_matches(';');
    let Some(storage) = outside(storage, names) else {
        return Err(format!(
            "nothing is added to `{equation}`: a constant or function of its package stands in `{storage}`, which has no meaning outside of it"
        ));
    };
    let rate = if balance.rate.starts_with("der(") { format!("der({state})") } else { full(&balance.rate) };
    let mut inputs = vec![(kind.law.0, Some(state.clone()))];
    let mut scales = vec![(kind.law.0.to_string(), state.clone()), (kind.law.1.to_string(), storage.clone())];
    if kind.id == "force" {
        let position = balance.integral.as_deref().map(full);
        scales.push(("a".into(), rate.clone()));
        scales.extend(position.iter().map(|position| ("s".into(), position.clone())));
        inputs = vec![("s", position), ("v", Some(state.clone())), ("a", Some(rate))];
    } else {
        inputs.push((kind.law.1, Some(storage.clone())));
    }
    let law = Law { inputs, output: kind.law.2 };
    let file = workshop.shown_file(&balance.site.file).to_string();
    let sizes: Vec<usize> =
        variable.name.parts.iter().flat_map(|(_, sizes)| sizes).map(|&size| size as usize).collect();
    let subscripts = subscripts(&sizes, number);
    let mut opened = |text: &str| {
        opened_end(balance, element, (kind, scaled), (workshop, text, known), (&sizes, &subscripts, opening))
    };
    // A library's text is changed only where no component can be connected instead.
    let end = match workshop.own_text(&balance.site.file) {
        Some(text) => opened(text),
        None => connected_end(balance, kind, &full, tables)
            .or_else(|| workshop.library_text(&balance.site.file).and_then(&mut opened)),
    };
    let Some(end) = end else { return Ok(None) };
    let driver = match (&end, kind.potential) {
        (End::Connector { connector, .. }, Some(potential)) => format!("{connector}.{potential}"),
        _ => state.clone(),
    };
    let unit_of = |name: &str| tables.find(name).map_or_else(|| "".into(), |(variable, _)| variable.unit.clone());
    let of_flow = scaled.map_or(balance.site.unit.as_deref(), |own| own.factor.unit.as_deref());
    let array: String = variable.name.parts.iter().map(|(text, _)| &**text).collect();
    Ok(Some(Store {
        units: [unit_of(&driver), of_flow.unwrap_or_default().into()],
        driver,
        storage,
        is_bare: scaled.is_none() && balance.storage.trim_start_matches(['-', '+', ' ']) == balance.rate,
        mentions: balance.mentions.iter().map(|name| full(name)).collect(),
        site: Site {
            id: kind.id.into(),
            path: state,
            words: Arc::from(format!("{}: {equation}", kind.words)),
            channel: None,
            file: file.into(),
            line: balance.site.line,
            door: Door::Balance { end, law },
            scales,
            array: (!sizes.is_empty()).then(|| array.into()),
        },
    }))
}

/// Subscripts of element `number` of an array, from 1, the last one fastest.
fn subscripts(sizes: &[usize], mut number: usize) -> Vec<usize> {
    let mut found: Vec<usize> = Vec::new();
    for size in sizes.iter().rev() {
        found.push(number % size + 1);
        number /= size;
    }
    found.reverse();
    found
}

/// How something comes into an equation of the model's file.
fn opened_end(
    balance: &Balance,
    element: &Element,
    (kind, scaled): (&Kind, Option<&Scaled>),
    (workshop, text, known): (&Workshop<'_>, &str, &[Site]),
    (sizes, subscripts, opening): (&[usize], &[usize], &mut Option<Opening>),
) -> Option<End> {
    // Of the component first, then of the variable in it.
    let outer = element.of_component().len();
    let is_array = balance.site.count > 1 && sizes.len() > outer;
    let (array, written) = match balance.state.split_once('[') {
        Some((array, written)) => (array, format!("[{written}")),
        None => (balance.state.as_str(), String::new()),
    };
    // Of arrays in components of the class another array would have to be made.
    if is_array && (array.contains('.') || written.contains('.')) {
        return None;
    }
    if opening.is_none() {
        let elements = is_array.then(|| Elements {
            array: array.into(),
            dimensions: sizes.len() - outer,
            subscripts: written.clone(),
        });
        let made = Opening {
            file: balance.site.file.clone(),
            line: balance.site.line,
            equation: balance.site.text.clone(),
            name: format!("further_{}", kind.id),
            words: format!("what the {} lacks", kind.words),
            factor: scaled.map_or_else(String::new, |own| own.factor.text.clone()),
            act: Act::Adds,
            elements,
        };
        let made = shared(made, (workshop, text), known)?;
        opened(text, std::slice::from_ref(&made))?;
        *opening = Some(made);
    }
    let own = if is_array { sizes.len() } else { outer };
    let element = At { sizes: sizes[..own].to_vec(), subscripts: subscripts[..own].to_vec() };
    let (path, is_reversed) = (balance.site.path.clone(), balance.is_reversed);
    Some(End::Equation { opening: opening.clone()?, path, is_reversed, element })
}

/// How something comes into a component of a library: at a connector that has the variables of the adapter's and no others.
fn connected_end(balance: &Balance, kind: &Kind, full: &dyn Fn(&str) -> String, tables: &Tables) -> Option<End> {
    let (adapter, socket, variables) = kind.adapter?;
    let ends = format!(".{}", variables[0]);
    let connector = full(balance.mentions.iter().find_map(|name| name.strip_suffix(&ends))?);
    // Without subscripts, as all elements of an array have the same.
    let whole = |own: &VariableInfo| own.name.parts.iter().map(|(text, _)| &**text).collect::<String>();
    let (known, _) = tables.find(&format!("{connector}.{}", variables[1]))?;
    let path = whole(known).strip_suffix(variables[1])?.to_string();
    let inside = |own: &VariableInfo| whole(own).strip_prefix(&*path).map(str::to_string);
    let mut found: Vec<String> = tables.variables.iter().filter_map(inside).collect();
    found.sort_unstable();
    let mut fitting = variables.map(String::from);
    fitting.sort_unstable();
    (!balance.is_reversed && found == fitting).then_some(End::Connector { connector, adapter, socket })
}

/// What a balance is of; where it is solved for its rate, with what multiplies that which comes in.
fn kind<'b>(
    balance: &'b Balance,
    unit: &str,
    is_known: &dyn Fn(&Scaled) -> bool,
) -> (&'static Kind, Option<&'b Scaled>) {
    let by = |is: &dyn Fn(&Kind) -> bool| KINDS.iter().find(|kind| is(kind));
    // By the unit of what comes in, beside that of what is stored.  Without units nothing tells a capacity from a time constant, or from a variable
    // that happens to divide.
    for scaled in balance.scaled.iter().filter(|own| is_known(own)) {
        let own = scaled.factor.unit.as_deref().unwrap_or_default();
        if let Some(kind) = by(&|kind| kind.units.contains(&own) && kind.stored.contains(&unit)) {
            return (kind, Some(scaled));
        }
    }
    let own = balance.site.unit.as_deref().filter(|unit| !unit.is_empty());
    let is_second = balance.integral.is_some();
    let name = balance.state.rsplit('.').next().unwrap_or(&balance.state).to_lowercase();
    let begins = |kind: &Kind| {
        kind.names.iter().any(|own| {
            let rest = name.strip_prefix(own);
            // A single letter stands alone, or before a number or an index.
            rest.is_some_and(|rest| own.len() > 1 || !rest.starts_with(|c: char| c.is_alphabetic()))
        })
    };
    let kind = by(&|kind| own.is_some_and(|own| kind.units.contains(&own)))
        .or_else(|| by(&|kind| kind.stored.contains(&unit)))
        .or_else(|| by(&|kind| begins(kind) && (kind.id == "voltage" || !is_second)))
        .or_else(|| by(&|kind| is_second && kind.id == "force"))
        .unwrap_or(&KINDS[KINDS.len() - 1]);
    (kind, None)
}
