//! The frames of an animation.

use clap::Args;

use super::shard;
use crate::cli::failure::Failure;
use crate::formats::film_file::RenderedView;

/// The frames to render.
#[derive(Args, Debug)]
#[command(next_help_heading = "Parts and frames")]
pub struct FrameOptions {
    /// Frames of an animation, such as 1-48, 1-48x2 (every other), 1,3,7-9 or all; 7/1-48 renders only frame 7 of these,
    /// with the exposure common to all, and auto/1-48 the one selected by the scheduler's task number; #### in -o
    /// stands for the frame's number
    #[arg(long, value_name = "LIST", value_parser = parse)]
    pub frames: Option<Frames>,
    /// Turn cameras once around what they look at, in this many frames, 1 to N; --frames chooses some of them
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=i64::from(MOST)))]
    pub turntable: Option<u32>,
    /// Frames per second: frame N is at N / fps seconds
    #[arg(long, value_name = "N", default_value_t = 24.0, value_parser = parse_fps)]
    pub fps: f32,
    /// Motion blur: the shutter is open for this part of the time between frames, such as 0.5
    #[arg(long, value_name = "PART", value_parser = parse_shutter)]
    pub shutter: Option<f32>,
    /// Number of moments within that time at which the scene is rendered, each with its part of the samples
    #[arg(long, value_name = "N", default_value_t = 16, value_parser = clap::value_parser!(u32).range(1..=i64::from(RenderedView::MOST_MOMENTS)))]
    pub moments: u32,
}

impl FrameOptions {
    /// The frames that the options name, if they name any.
    pub fn given(&self) -> Option<Frames> {
        let all = || Frames { ranges: Vec::new(), of_them: OfThem::All };
        self.frames.clone().or(self.turntable.map(|_| all()))
    }
}

/// A list of frames.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Frames {
    /// The first and last frame and the step of each range; empty for all frames of the animation.
    ranges: Vec<[u32; 3]>,
    /// The frames of the list that are rendered.
    of_them: OfThem,
}

/// The frames of a list that a process renders.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum OfThem {
    All,
    One(u32),
    /// The one selected by the scheduler's task number.
    ByScheduler,
}

/// The largest frame number: more than needed, and small enough to catch one digit too many.
const MOST: u32 = 1_000_000;

impl Frames {
    /// Returns the list with its frames if it is `all`. `end` gives the time of the animation's last frame in seconds.
    pub fn until(
        self,
        fps: f32,
        end: impl FnOnce() -> Result<Option<f32>, Failure>,
    ) -> Result<Frames, Failure> {
        if !self.ranges.is_empty() {
            return Ok(self);
        }
        let Some(end) = end()? else {
            let reason = "nothing in the scene says when it ends: give the first and the last frame";
            return Err(Failure::command_line(format!("--frames all: {reason}, such as --frames 0-48")));
        };
        // A last frame that is late by no more than rounding belongs to it.
        let last = (f64::from(end) * f64::from(fps) + 1e-3).floor().clamp(0.0, f64::from(u32::MAX));
        if last > f64::from(MOST) {
            let reason = format!("there are {last} frames: at most {MOST} can be rendered (--fps)");
            return Err(Failure::command_line(format!("--frames all: {reason}")));
        }
        self.all_from(0, last as u32)
    }

    /// Returns the list with its frames if it is `all`, for a turntable of `count` frames, which must have them.
    pub fn around(self, count: u32) -> Result<Frames, Failure> {
        if self.ranges.is_empty() {
            return self.all_from(1, count);
        }
        let outside = self.numbers().find(|frame| !(1..=count).contains(frame));
        match outside {
            Some(frame) => Err(Failure::command_line(format!(
                "--frames: a turntable of {count} has no frame {frame}: its frames are 1 to {count}"
            ))),
            None => Ok(self),
        }
    }

    /// Returns the list `all` with its frames.
    fn all_from(self, first: u32, last: u32) -> Result<Frames, Failure> {
        let frames = Frames { ranges: vec![[first, last, 1]], of_them: self.of_them };
        match frames.of_them {
            OfThem::One(frame) if !(first..=last).contains(&frame) => {
                Err(Failure::command_line(format!("--frames: frame {frame} is none of {frames}")))
            }
            _ => Ok(frames),
        }
    }

    /// Returns the frame numbers in the order given.
    pub fn numbers(&self) -> impl Iterator<Item = u32> {
        self.ranges.iter().flat_map(|[first, last, step]| (*first..=*last).step_by(*step as usize))
    }

    /// Returns the frames that this process renders.
    pub fn resolve(&self) -> Result<Frames, Failure> {
        let frame = match self.of_them {
            OfThem::All => return Ok(self.clone()),
            OfThem::One(frame) => frame,
            OfThem::ByScheduler => {
                let count = self.numbers().count() as u32;
                let task = shard::number_of_task(count)
                    .map_err(|reason| Failure::command_line(format!("--frames auto: {reason}")))?;
                self.numbers().nth(task as usize).unwrap_or_default()
            }
        };
        Ok(Frames { ranges: vec![[frame, frame, 1]], of_them: OfThem::All })
    }
}

impl std::fmt::Display for Frames {
    /// Writes the list in the form that `--frames` takes.
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        for (place, [first, last, step]) in self.ranges.iter().enumerate() {
            let comma = if place > 0 { "," } else { "" };
            match (first == last, step) {
                (true, _) => write!(f, "{comma}{first}")?,
                (false, 1) => write!(f, "{comma}{first}-{last}")?,
                (false, step) => write!(f, "{comma}{first}-{last}x{step}")?,
            }
        }
        Ok(())
    }
}

fn parse(text: &str) -> Result<Frames, String> {
    let number = |text: &str| text.trim().parse().ok().filter(|number| *number <= MOST);
    let (of_them, list) = match text.split_once('/') {
        None => (Some(OfThem::All), text),
        Some(("auto", list)) => (Some(OfThem::ByScheduler), list),
        Some((frame, list)) => (number(frame).map(OfThem::One), list),
    };
    let range = |part: &str| {
        let (range, step) = match part.split_once('x') {
            Some((range, step)) => (range, number(step)?),
            None => (part, 1),
        };
        let (first, last) = range.split_once('-').unwrap_or((range, range));
        let range = [number(first)?, number(last)?, step];
        (range[0] <= range[1] && step > 0).then_some(range)
    };
    let ranges: Option<Vec<_>> = match list.trim() {
        "all" => Some(Vec::new()),
        list => list.split(',').map(range).collect(),
    };
    let frames = ranges.zip(of_them).map(|(ranges, of_them)| Frames { ranges, of_them });
    let frames =
        frames.ok_or("expected frames, such as 1-48, 1-48x2, 1,3,7-9, all, or 7/1-48 for one of several")?;
    match frames.of_them {
        OfThem::One(frame)
            if !frames.ranges.is_empty() && !frames.numbers().any(|number| number == frame) =>
        {
            Err(format!("frame {frame} is none of {frames}"))
        }
        _ => Ok(frames),
    }
}

fn parse_fps(text: &str) -> Result<f32, String> {
    let fps = text.parse().ok().filter(|fps: &f32| (0.001..=100_000.0).contains(fps));
    fps.ok_or_else(|| "expected frames a second, such as 24".into())
}

fn parse_shutter(text: &str) -> Result<f32, String> {
    let part = text.parse().ok().filter(|part: &f32| *part > 0.0 && *part <= 1.0);
    part.ok_or_else(|| "expected a part of the time from frame to frame, above 0 and at most 1".into())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frame_lists_parse_and_print() {
        let numbers = |text: &str| parse(text).map(|frames| frames.numbers().collect::<Vec<_>>());
        assert_eq!(numbers("1-5"), Ok(vec![1, 2, 3, 4, 5]));
        assert_eq!(numbers("0-10x4, 3"), Ok(vec![0, 4, 8, 3]));
        assert_eq!(parse("0-10x4, 3,5-6").map(|frames| frames.to_string()), Ok("0-10x4,3,5-6".into()));
        for wrong in
            ["", "auto", "a", "5-1", "1-5x0", "1-", "-3", "1,,2", "1-99999999", "4/1-3", "a/1-3", "1-2/1-3"]
        {
            assert!(numbers(wrong).is_err(), "{wrong}");
        }
        let one = parse("3/1-5x2").ok().and_then(|frames| Some((frames.to_string(), frames.resolve().ok()?)));
        let one = one.map(|(list, frames)| (list, frames.numbers().collect::<Vec<_>>()));
        assert_eq!(one, Some(("1-5x2".into(), vec![3])));
    }

    #[test]
    fn turntables_have_the_frames_from_1_to_their_number() {
        let around = |text: &str| {
            let frames = parse(text).expect(text).around(5);
            frames.ok().map(|frames| frames.to_string())
        };
        for (text, printed) in [("all", "1-5"), ("2/all", "1-5"), ("1-6x4", "1-6x4"), ("5,1", "5,1")] {
            assert_eq!(around(text), Some(printed.to_owned()), "{text}");
        }
        for wrong in ["0-5", "6", "1,7", "1-9x4", "0/all", "6/all"] {
            assert_eq!(around(wrong), None, "{wrong}");
        }
    }

    #[test]
    fn all_frames_reach_the_end_of_the_animation() {
        let all = |text: &str, fps: f32, end: Option<f32>| {
            let frames = parse(text).unwrap().until(fps, || Ok(end));
            frames.and_then(|frames| Ok((frames.to_string(), frames.resolve()?.to_string())))
        };
        let is = |list: &str, resolved: &str| Some((list.to_owned(), resolved.to_owned()));
        assert_eq!(all("all", 24.0, Some(2.0)).ok(), is("0-48", "0-48"));
        assert_eq!(all("all", 24.0, Some(41.0 / 24.0)).ok(), is("0-41", "0-41"), "rounded down by a hair");
        assert_eq!(all("all", 10.0, Some(0.55)).ok(), is("0-5", "0-5"));
        assert_eq!(all("all", 24.0, Some(0.0)).ok(), is("0", "0"));
        assert_eq!(all("3/all", 24.0, Some(1.0)).ok(), is("0-24", "3"));
        assert_eq!(all("7-9", 24.0, None).ok(), is("7-9", "7-9"));
        for (text, end) in [("all", None), ("30/all", Some(1.0)), ("all", Some(1e9))] {
            assert!(all(text, 24.0, end).is_err(), "{text} {end:?}");
        }
    }
}
