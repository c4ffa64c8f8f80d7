//! The curves of a report (`trajectories.csv`), shot by shot.

use super::Channel;

/// The curves of one shot.
pub(super) struct Record {
    pub(super) number: usize,
    pub(super) times: Vec<f64>,
    /// Measured, base and found by channel.
    pub(super) traces: Vec<Option<[Vec<f64>; 3]>>,
}

/// True if a shot has no curves of another channel.
fn is_alone(record: &Record, channel: usize) -> bool {
    record.traces.iter().enumerate().all(|(k, trace)| k == channel || trace.is_none())
}

/// The curves of a report, shot by shot.
///
/// # Errors
/// The number of a line that is not one of them.
pub(super) fn records(text: &str, channels: &[Channel]) -> Result<Vec<Record>, usize> {
    let mut all: Vec<Record> = Vec::new();
    let mut last = None;
    for (line, row) in text.lines().enumerate().skip(1).map(|(k, row)| (k + 1, row)) {
        // A name of a channel may hold commas: what stands before and behind it does not.
        let (number, rest) = row.split_once(',').ok_or(line)?;
        let number: usize = number.parse().map_err(|_| line)?;
        let mut fields = rest.rsplitn(6, ',');
        let mask = fields.next().ok_or(line)?;
        let mut value = || fields.next().ok_or(line);
        let (found, base, measured, time, name) = (value()?, value()?, value()?, value()?, value()?);
        let parsed = |text: &str| text.parse::<f64>().map_err(|_| line);
        let channel = channels.iter().position(|own| own.name == name).ok_or(line)?;
        let time = parsed(time)?;
        // Shots of one number stand one behind the other.
        let is_back = all.last().is_some_and(|own| own.traces[channel].is_some() && own.times.last() >= Some(&time));
        if last != Some((number, channel)) || is_back && all.last().is_some_and(|own| is_alone(own, channel)) {
            let is_same = all.last().is_some_and(|own| own.number == number && own.traces[channel].is_none());
            if !is_same {
                let traces = channels.iter().map(|_| None).collect();
                all.push(Record { number, times: Vec::new(), traces });
            }
            last = Some((number, channel));
        }
        let Some(own) = all.last_mut() else { continue };
        let is_first = is_alone(own, channel);
        let curves = own.traces[channel].get_or_insert_with(Default::default);
        if is_first {
            own.times.push(time);
        } else if own.times.get(curves[0].len()) != Some(&time) {
            return Err(line);
        }
        let is_counted = mask == "0";
        curves[0].push(if is_counted { parsed(measured)? } else { f64::NAN });
        curves[1].push(parsed(base)?);
        curves[2].push(parsed(found)?);
    }
    let is_whole = |own: &Record| own.traces.iter().flatten().all(|trace| trace[0].len() == own.times.len());
    if all.iter().all(is_whole) { Ok(all) } else { Err(text.lines().count()) }
}

#[cfg(test)]
mod tests {
    use super::{Channel, Record, records};

    fn read(text: &str, names: &[&str]) -> Result<Vec<Record>, usize> {
        let channel = |name: &&str| Channel {
            name: name.to_string(),
            unit: String::new(),
            words: String::new(),
            expression: String::new(),
            sigma: 1.0,
        };
        let channels: Vec<Channel> = names.iter().map(channel).collect();
        records(&format!("shot,channel,time_s,measured,base,extended,mask\n{text}"), &channels)
    }

    /// Numbers of shots with the number of their samples and of their channels.
    fn shapes(text: &str, names: &[&str]) -> Result<Vec<(usize, usize, usize)>, usize> {
        let shape = |own: &Record| (own.number, own.times.len(), own.traces.iter().flatten().count());
        read(text, names).map(|all| all.iter().map(shape).collect())
    }

    #[test]
    fn shots_are_told_apart_by_their_numbers_their_channels_and_their_times() {
        let two = "1,x,0,1,2,3,0\n1,x,1,,2,3,1\n1,y,0,1,2,3,0\n1,y,1,1,2,3,0\n2,x,0,1,2,3,0\n";
        assert_eq!(shapes(two, &["x", "y"]), Ok(vec![(1, 2, 2), (2, 1, 1)]));
        // Several shots of one number, of one channel and of two.
        let alike = "1,x,0,1,2,3,0\n1,x,1,1,2,3,0\n1,x,0,1,2,3,0\n1,x,1,1,2,3,0\n";
        assert_eq!(shapes(alike, &["x"]), Ok(vec![(1, 2, 1), (1, 2, 1)]));
        let alike = "1,x,0,1,2,3,0\n1,y,0,1,2,3,0\n1,x,0,1,2,3,0\n1,y,0,1,2,3,0\n";
        assert_eq!(shapes(alike, &["x", "y"]), Ok(vec![(1, 1, 2), (1, 1, 2)]));
        assert_eq!(shapes("3,\"a, b\",0,1,2,3,0\n", &["\"a, b\""]), Ok(vec![(3, 1, 1)]));
    }

    #[test]
    fn samples_that_do_not_count_have_no_value() {
        let Ok(all) = read("1,x,0,,2,3,1\n1,x,1,5,2,3,0\n", &["x"]) else { panic!("refused") };
        let Some([measured, base, found]) = &all[0].traces[0] else { panic!("no curves") };
        assert!(measured[0].is_nan() && measured[1] == 5.0 && base == &[2.0, 2.0] && found == &[3.0, 3.0]);
    }

    #[test]
    fn what_is_no_curve_is_named_by_its_line() {
        for (text, line) in [
            ("1,x,0,1,2,3,0\n1,z,0,1,2,3,0\n", 3),
            ("1,x,0,1,2,3,0\n1,x,soon,1,2,3,0\n", 3),
            ("1,x,0,1,2\n", 2),
            ("one,x,0,1,2,3,0\n", 2),
            // A channel that lacks a sample, or has it at another time.
            ("1,x,0,1,2,3,0\n1,x,1,1,2,3,0\n1,y,0,1,2,3,0\n", 4),
            ("1,x,0,1,2,3,0\n1,y,0.5,1,2,3,0\n", 3),
        ] {
            assert_eq!(shapes(text, &["x", "y"]), Err(line), "{text}");
        }
    }
}
