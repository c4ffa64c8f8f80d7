//! The rule of names: from what each candidate's fit has brought to a name, to several, or to none.
//!
//! It knows nothing of models and measurements, so that every case of it can be stated.

use crate::evidence::thresholds::{ERRORS, LEAD, NEEDED, NOTHING};
use hyd_system::math;

/// Share of what noise does not explain that a name may leave where the rest is alike over several samples: what explains less imitates a
/// part of something else.
const NEARLY_ALL: f64 = 0.8;
/// Share of what is missing that the first of several names leaves where a law may explain it all instead.
const PIECE: f64 = 0.05;
/// Shots held out show what the others hide when their mean square exceeds that of noise by this factor times the excess of the fitted
/// ones, and that counts as no less than the second number.
const HIDDEN: (f64, f64) = (5.0, 0.1);
/// What scatter pays for each number that it has more than the effects in whose place it is taken up, and an effect for each that it has more
/// than one that would do in its place.
const OF_EACH_NUMBER: f64 = 3.0;
/// Hum and drift come before effects where they explain this share of the excess over noise, and this multiple of what the likeliest effect
/// promises.
const OF_CHAINS: (f64, f64) = (0.25, 3.0);
/// Fewest shots whose sizes have an order, and the standard errors by which neighbours differ.
const ORDERED: (usize, f64) = (4, 3.0);

/// What the fit of a candidate has brought.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(super) struct Standing {
    /// Where its fit ended.
    pub cost: f64,
    /// Its misfit per expected misfit, at least 1: what a drop of the cost is measured in.
    pub scale: f64,
    /// Drop of the cost against the fit without.
    pub cost_drop: f64,
    /// The drop it needs.
    pub needed: f64,
    /// Its size in standard errors from nothing; none where it is not known.
    pub errors: Option<f64>,
    /// Its numbers can be.
    pub is_plausible: bool,
    /// The plainer one, at the same place, of which it is a case with further numbers.
    pub plainer: Option<usize>,
}

impl Standing {
    /// True if the size is known well enough for a name.
    pub(super) fn has_size(&self) -> bool {
        has_size(self.errors)
    }

    /// True if it is the model without.
    pub(super) fn is_nothing(&self) -> bool {
        is_nothing(self.errors)
    }

    /// True if it explains more than chance would.
    fn is_needed(&self) -> bool {
        !self.is_nothing() && self.cost_drop >= self.needed
    }
}

/// True if a size of so many standard errors is known well enough for a name.
pub(super) fn has_size(errors: Option<f64>) -> bool {
    errors.is_some_and(|errors| errors >= ERRORS)
}

/// True if a size of so many standard errors is none.
pub(super) fn is_nothing(errors: Option<f64>) -> bool {
    errors.is_some_and(|errors| errors < NOTHING)
}

/// How the model without any of the candidates stands.
#[derive(Clone, Copy)]
pub(super) struct Without {
    /// What it leaves counts as noise ([`crate::evidence::thresholds::ADEQUATE`]).
    pub is_adequate: bool,
    /// What it leaves is within the scatter of noise, or effects were named already.
    pub is_noise: bool,
}

/// What a pass says.
#[derive(PartialEq, Debug)]
pub(super) enum Outcome {
    /// Nothing is missing any more.
    Nothing,
    /// This one.
    Name(usize),
    /// These explain it equally well.
    Several(Vec<usize>),
    /// Something is missing and nothing explains it.
    Unexplained,
}

/// The candidate of the lowest cost that brings the model nearer to the measurement by more than it needs itself,
/// whatever else may speak against it.  Candidates that were not fitted have no standing.
pub(super) fn leader(standings: &[Option<Standing>]) -> Option<usize> {
    let needed = standings.iter().enumerate().filter_map(|(k, own)| Some((k, own.filter(Standing::is_needed)?.cost)));
    needed.min_by(|(_, a), (_, b)| a.total_cmp(b)).map(|(k, _)| k)
}

/// What the standings say; `is_beaten` tells whether a plain term explains what the leader leaves.
pub(super) fn outcome(
    standings: &[Option<Standing>],
    without: Without,
    is_beaten: impl FnOnce(usize) -> bool,
) -> Outcome {
    let none = if without.is_adequate { Outcome::Nothing } else { Outcome::Unexplained };
    let fitted = || standings.iter().enumerate().filter_map(|(k, own)| Some((k, (*own)?)));
    let Some((at, first)) = leader(standings).and_then(|k| Some((k, standings[k]?))) else { return none };
    if is_beaten(at) {
        return Outcome::Unexplained;
    }
    let behind = |own: &Standing| (own.cost - first.cost) / first.scale;
    // What explains more, though less than it needs itself, is a rival all the same.
    if fitted().any(|(_, own)| !own.is_nothing() && behind(&own) < -LEAD) {
        return none;
    }
    let is_close = |own: &Standing| own.is_needed() && behind(own) < LEAD;
    let is_sound = |own: &Standing| own.has_size() && own.is_plausible;
    let close: Vec<usize> = fitted().filter(|(_, own)| is_close(own) && is_sound(own)).map(|(k, _)| k).collect();
    // What leads uncertainly, or with numbers that cannot be, shows nothing where only noise is left without it.
    let is_doubtful = without.is_noise || !first.has_size();
    // Of a law and the same with further numbers that explain no more, the plain one is the answer.
    let is_refined =
        |k: &usize| standings[*k].and_then(|own| own.plainer).is_some_and(|plainer| close.contains(&plainer));
    let close: Vec<usize> = close.iter().copied().filter(|k| !is_refined(k)).collect();
    match close[..] {
        [] if without.is_adequate && is_doubtful => Outcome::Nothing,
        [] => Outcome::Unexplained,
        [k] => Outcome::Name(k),
        _ => Outcome::Several(close),
    }
}

/// What becomes of an effect once a rival was fitted in its place.
#[derive(PartialEq, Debug)]
pub(super) enum Exchange {
    /// It explains more than the rival, or the rival only with numbers that cannot be.
    Stays,
    /// The two explain equally well.
    Open,
    /// The rival takes its place.
    Replaced,
}

/// What a rival does in the place of an effect: by how much the cost falls, in units of the noise left, whether the numbers of the effect
/// and of the rival can be, and how many numbers fewer the rival has, each of which has a price.
pub(super) fn exchange(cost_drop: f64, [is_plausible, is_rival_plausible]: [bool; 2], fewer: usize) -> Exchange {
    let is_plainer = fewer > 0 && cost_drop >= -OF_EACH_NUMBER * fewer as f64;
    if !is_rival_plausible || cost_drop <= -LEAD {
        Exchange::Stays
    } else if cost_drop >= LEAD || !is_plausible || is_plainer {
        Exchange::Replaced
    } else {
        Exchange::Open
    }
}

/// True if hum and drift explain so much of the excess over noise that nothing can be said of effects before they are counted; `promise` is the
/// gain of the likeliest effect by its screening, 0 where effects are not asked.
pub(super) fn is_of_chains(explained: f64, excess: f64, promise: f64) -> bool {
    explained >= OF_CHAINS.0 * excess && explained >= OF_CHAINS.1 * promise
}

/// True if a fit of a lower cost is taken in place of another one: by however little, but not an implausible one in
/// place of a plausible one for less than the lead a name takes.
pub(super) fn is_taken(
    cost_drop: f64,
    scale: f64,
    was_plausible: impl Fn() -> bool,
    is_plausible: impl Fn() -> bool,
) -> bool {
    cost_drop > 0.0 && (cost_drop >= LEAD * scale || !was_plausible() || is_plausible())
}

/// True if a term explains what the leading effect leaves: by more than a lead where something is left beside it, by
/// more than a name takes where only noise is, of which one of many terms always explains a little.
pub(super) fn is_beaten_by(lead: f64, leaves_noise: bool) -> bool {
    lead > if leaves_noise { NEEDED } else { LEAD }
}

/// Where the terms act that explain most, if that is more than all effects promise by a lead; none else.
pub(super) fn places_of_more<'a>(gains: &[(f64, &'a str)], most: f64) -> Vec<&'a str> {
    let best = gains.iter().map(|(gain, _)| *gain).fold(0.0, f64::max);
    if best < most + LEAD {
        return Vec::new();
    }
    gains.iter().filter(|(gain, _)| *gain > best - LEAD).map(|&(_, place)| place).collect()
}

/// The share of what noise does not explain that a name leaves (roots of mean squares in noise, before and after), if that is too much for a
/// name: where the rest is alike over several samples, what explains next to nothing imitates a part of something else.
pub(super) fn imitates((before, after): (f64, f64), is_alike: bool) -> Option<f64> {
    let beyond = |gap: f64| (gap * gap - 1.0).max(0.0);
    let share = beyond(after) / beyond(before).max(f64::MIN_POSITIVE);
    (is_alike && share > NEARLY_ALL).then_some(share)
}

/// True if the first of several names leaves a part of what was missing that counts: misfits without it and with it, and what noise leaves, as
/// expected and at most.
pub(super) fn is_pieced((without, with): (f64, f64), (expected, noise): (f64, f64)) -> bool {
    with > noise && with - expected > PIECE * (without - expected)
}

/// The largest misfit with which scatter from shot to shot takes the place of effects, where the model with the effects leaves `misfit` and noise
/// as stated, if that is what counts, at most `stated`.  Where the level of model error counts, every level is that of a model that leaves as
/// much, and numbers decide: those of scatter (one for each shot) and those of the effects.
pub(super) fn enough_for_scatter(misfit: f64, stated: Option<f64>, (of_scatter, of_effects): (usize, usize)) -> f64 {
    match stated {
        Some(stated) => stated.max(misfit + LEAD),
        None => misfit + LEAD - OF_EACH_NUMBER * of_scatter.saturating_sub(of_effects) as f64,
    }
}

/// The same where the effects have sizes that only grow or only fall from shot to shot: of a few shots, chance orders them in one bench of a handful
/// ([`has_order`]), so that scatter which explains more is the better answer; what explains only as much is not.
pub(super) fn enough_against_order(misfit: f64, (of_scatter, of_effects): (usize, usize)) -> f64 {
    misfit - LEAD - OF_EACH_NUMBER * of_scatter.saturating_sub(of_effects) as f64
}

/// True if shots held out show a gap of which the fitted ones hide the most: by how much the mean squares exceed that of noise there, and in the
/// fitted shots.
pub(super) fn is_hidden(held_out: f64, fitted: f64) -> bool {
    held_out > HIDDEN.0 * fitted.max(HIDDEN.1)
}

/// True if sizes with their standard errors, in the order of the shots, only grow or only fall, by more than they are uncertain: what scatters
/// has no order.  Of `n` shots chance alone puts two in `n!` so.
pub(super) fn has_order(sizes: &[(f64, f64)]) -> bool {
    let is_monotone = |sign: f64| {
        let grows =
            |pair: &[(f64, f64)]| sign * (pair[1].0 - pair[0].0) > ORDERED.1 * math::hypot(pair[0].1, pair[1].1);
        sizes.windows(2).all(grows)
    };
    sizes.len() >= ORDERED.0 && (is_monotone(1.0) || is_monotone(-1.0))
}

#[cfg(test)]
mod tests {
    use super::{
        Exchange, Outcome, Standing, Without, enough_against_order, enough_for_scatter, exchange, has_order, imitates,
        is_beaten_by, is_hidden, is_of_chains, is_pieced, is_taken, leader, outcome, places_of_more,
    };

    const UNEXPLAINED: Without = Without { is_adequate: false, is_noise: false };
    const NOISE: Without = Without { is_adequate: true, is_noise: true };

    /// A sound candidate whose cost is that of a fit without (1000) less the drop.
    fn sound(cost_drop: f64) -> Option<Standing> {
        let (scale, needed, errors) = (1.0, 25.0, Some(20.0));
        Some(Standing { cost: 1000.0 - cost_drop, scale, cost_drop, needed, errors, is_plausible: true, plainer: None })
    }

    fn with(own: Option<Standing>, change: impl FnOnce(&mut Standing)) -> Option<Standing> {
        own.map(|mut own| {
            change(&mut own);
            own
        })
    }

    fn says(standings: &[Option<Standing>], without: Without) -> Outcome {
        outcome(standings, without, |_| false)
    }

    #[test]
    fn the_one_that_leads_by_enough_is_named() {
        assert_eq!(says(&[sound(300.0), sound(289.0)], UNEXPLAINED), Outcome::Name(0));
        assert_eq!(says(&[sound(300.0), sound(291.0), sound(280.0)], UNEXPLAINED), Outcome::Several(vec![0, 1]));
        // Whatever place it has in the list.
        assert_eq!(says(&[None, sound(100.0), sound(300.0)], UNEXPLAINED), Outcome::Name(2));
        // Where more than noise is left beside the effect, a lead is measured in that.
        let loud = |cost_drop| with(sound(cost_drop), |own| own.scale = 2.0);
        assert_eq!(says(&[loud(300.0), loud(281.0)], UNEXPLAINED), Outcome::Several(vec![0, 1]));
    }

    #[test]
    fn hum_comes_before_effects_only_where_it_explains_far_more() {
        assert!(is_of_chains(4400.0, 12_000.0, 290.0) && is_of_chains(6400.0, 6500.0, 34.0));
        // An effect that promises about as much is searched under noise as stated, as is what is mostly something else.
        assert!(!is_of_chains(700.0, 1500.0, 630.0) && !is_of_chains(2000.0, 12_000.0, 0.0));
    }

    #[test]
    fn a_rival_takes_the_place_of_what_explains_less_or_cannot_be() {
        let both = [true, true];
        assert_eq!((exchange(11.0, both, 0), exchange(-11.0, both, 5)), (Exchange::Replaced, Exchange::Stays));
        assert_eq!((exchange(9.0, both, 0), exchange(-9.0, both, 0)), (Exchange::Open, Exchange::Open));
        // Numbers that cannot be decide where both explain as much.
        assert_eq!(
            (exchange(-9.0, [false, true], 0), exchange(-11.0, [false, true], 0)),
            (Exchange::Replaced, Exchange::Stays)
        );
        let implausible = [true, false];
        assert_eq!((exchange(9.0, implausible, 2), exchange(99.0, implausible, 0)), (Exchange::Stays, Exchange::Stays));
        // Two numbers fewer are worth 6.
        assert_eq!((exchange(-5.9, both, 2), exchange(-6.1, both, 2)), (Exchange::Replaced, Exchange::Open));
    }

    #[test]
    fn scatter_pays_for_its_numbers_where_model_error_counts() {
        assert_eq!(enough_for_scatter(200.0, Some(220.0), (6, 1)), 220.0);
        assert_eq!(enough_for_scatter(230.0, Some(220.0), (6, 1)), 240.0);
        // Six numbers in place of one must explain more.
        assert_eq!(enough_for_scatter(200.0, None, (6, 1)), 195.0);
        assert_eq!(enough_for_scatter(200.0, None, (6, 6)), 210.0);
    }

    #[test]
    fn scatter_has_to_explain_more_than_sizes_in_order() {
        // Two parameters that scatter over three shots (six numbers) in place of a temperature of each shot and its coefficient.
        let enough = enough_against_order(15_843.0, (6, 2));
        assert!(15_447.0 < enough && 15_830.0 > enough && enough == 15_821.0);
        assert!(enough < enough_for_scatter(15_843.0, None, (6, 2)));
    }

    #[test]
    fn what_shots_held_out_show_is_a_gap_where_the_fitted_ones_hide_it() {
        // A law that imitates parameters that scatter leaves 2 % beyond noise in the fitted shots and 41 % in the one held out.
        assert!(is_hidden(1.41 * 1.41 - 1.0, 1.02 * 1.02 - 1.0));
        // Scatter of the mean square itself is not a gap, nor is what the fitted shots show as well.
        assert!(!is_hidden(0.4, 0.01) && !is_hidden(4.0, 1.0));
    }

    #[test]
    fn further_numbers_that_explain_no_more_do_not_make_a_choice() {
        let refined = |cost_drop, plainer| with(sound(cost_drop), |own| own.plainer = Some(plainer));
        assert_eq!(says(&[refined(305.0, 1), sound(300.0)], UNEXPLAINED), Outcome::Name(1));
        // Where they explain more than a lead they are needed.
        assert_eq!(says(&[refined(311.0, 1), sound(300.0)], UNEXPLAINED), Outcome::Name(0));
        assert_eq!(says(&[refined(305.0, 1), sound(300.0), sound(301.0)], UNEXPLAINED), Outcome::Several(vec![1, 2]));
        // Beside another one it stands like any other.
        assert_eq!(says(&[refined(305.0, 2), sound(300.0), None], UNEXPLAINED), Outcome::Several(vec![0, 1]));
    }

    #[test]
    fn a_fall_below_what_it_needs_is_no_name() {
        assert_eq!(says(&[sound(24.0)], NOISE), Outcome::Nothing);
        assert_eq!(says(&[sound(24.0)], UNEXPLAINED), Outcome::Unexplained);
        assert_eq!(says(&[], UNEXPLAINED), Outcome::Unexplained);
        assert_eq!(says(&[None], NOISE), Outcome::Nothing);
        assert_eq!(says(&[sound(26.0)], NOISE), Outcome::Name(0));
    }

    #[test]
    fn what_needs_more_blocks_but_does_not_hide() {
        let demanding = |cost_drop| with(sound(cost_drop), |own| own.needed = 400.0);
        // It leads by more than the lead: the other one is not the explanation.
        assert_eq!(says(&[demanding(320.0), sound(300.0)], UNEXPLAINED), Outcome::Unexplained);
        assert_eq!(says(&[demanding(320.0), sound(300.0)], NOISE), Outcome::Nothing);
        // It leads by less: the other one is named, and it is not a rival, for chance explains as much.
        assert_eq!(says(&[demanding(305.0), sound(300.0)], UNEXPLAINED), Outcome::Name(1));
        // A size of nothing is the model without, however low its cost.
        let nothing = with(sound(400.0), |own| own.errors = Some(1.0));
        assert_eq!(says(&[nothing, sound(300.0)], UNEXPLAINED), Outcome::Name(1));
    }

    #[test]
    fn an_uncertain_size_or_implausible_numbers_are_no_name() {
        let uncertain = with(sound(300.0), |own| own.errors = Some(3.9));
        let unknown = with(sound(300.0), |own| own.errors = None);
        let odd = with(sound(300.0), |own| own.is_plausible = false);
        for own in [uncertain, unknown, odd] {
            assert_eq!(says(&[own], UNEXPLAINED), Outcome::Unexplained);
            assert_eq!(says(&[own], NOISE), Outcome::Nothing);
            // One that explains it as well is named; one that explains less is not the explanation.
            assert_eq!(says(&[own, sound(295.0)], UNEXPLAINED), Outcome::Name(1));
            assert_eq!(says(&[own, sound(250.0)], UNEXPLAINED), Outcome::Unexplained);
        }
        // More than scatter is left and something explains it with a well known size: it is missing, whatever it is.
        let scattered = Without { is_adequate: true, is_noise: false };
        assert_eq!(says(&[odd], scattered), Outcome::Unexplained);
        assert_eq!(says(&[uncertain], scattered), Outcome::Nothing);
    }

    #[test]
    fn a_term_that_explains_the_rest_refuses_the_name() {
        let standings = [sound(100.0), sound(300.0)];
        assert_eq!(outcome(&standings, UNEXPLAINED, |k| k == leader(&standings).unwrap_or(0)), Outcome::Unexplained);
        assert_eq!(outcome(&standings, UNEXPLAINED, |k| k == 0), Outcome::Name(1));
        assert!(is_beaten_by(11.0, false) && !is_beaten_by(9.0, false));
        assert!(is_beaten_by(26.0, true) && !is_beaten_by(24.0, true));
    }

    #[test]
    fn places_count_where_terms_promise_more_than_effects() {
        let gains = [(300.0, "stop"), (295.0, "seat"), (280.0, "spool")];
        assert_eq!(places_of_more(&gains, 289.0), ["stop", "seat"]);
        assert!(places_of_more(&gains, 291.0).is_empty());
        assert!(places_of_more(&[], 0.0).is_empty());
    }

    #[test]
    fn a_name_that_leaves_nearly_all_imitates() {
        // Mean squares of 1.21 and 1.17 are an excess of 0.21 and 0.17.
        let (before, after) = (1.1, 1.17_f64.sqrt());
        assert!(imitates((before, after), true).is_some_and(|share| (share - 0.17 / 0.21).abs() < 1e-12));
        // Noise that is more than stated is white.
        assert_eq!(imitates((before, after), false), None);
        assert_eq!(imitates((before, 1.16_f64.sqrt()), true), None);
        // Nothing was missing.
        assert_eq!(imitates((1.0, 0.99), true), None);
        assert!(imitates((1.0, 1.1), true).is_some());
    }

    #[test]
    fn names_are_pieces_where_the_first_leaves_what_counts() {
        let noise = (1000.0, 1060.0);
        assert!(is_pieced((3000.0, 1200.0), noise) && !is_pieced((3000.0, 1050.0), noise));
        assert!(!is_pieced((9000.0, 1300.0), noise));
    }

    #[test]
    fn sizes_have_an_order_by_more_than_their_errors() {
        assert!(has_order(&[(0.0, 0.1), (4.0, 0.1), (6.4, 0.1), (7.9, 0.1)]));
        assert!(has_order(&[(7.9, 0.1), (6.4, 0.1), (4.0, 0.1), (0.0, 0.1)]));
        assert!(!has_order(&[(0.0, 0.1), (6.4, 0.1), (4.0, 0.1), (7.9, 0.1)]));
        assert!(!has_order(&[(0.0, 0.1), (4.0, 0.1), (6.4, 0.5), (7.9, 0.5)]));
        // One of six orders of three shots is as easily chance.
        assert!(!has_order(&[(0.0, 0.1), (4.0, 0.1), (6.4, 0.1)]));
    }

    #[test]
    fn a_lower_cost_is_taken_unless_it_is_bought_with_odd_numbers() {
        let taken = |cost_drop, was: bool, is: bool| is_taken(cost_drop, 2.0, || was, || is);
        assert!(taken(0.1, true, true) && taken(0.1, false, false) && taken(0.1, false, true));
        assert!(!taken(0.1, true, false) && !taken(19.9, true, false) && taken(20.1, true, false));
        assert!(!taken(0.0, true, true) && !taken(-1.0, false, true) && !taken(f64::NAN, false, true));
    }
}
