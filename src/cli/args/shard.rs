//! The part of the samples that this process renders, as given or by its scheduler.

use crate::cli::failure::Failure;

/// The value of `--shard`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ShardOption {
    /// The index of the part, from 0; `None` for the one given by the scheduler.
    index: Option<u32>,
    /// The number of parts; `None` for the one given by the scheduler.
    count: Option<u32>,
}

/// The environment variables in which a scheduler gives a task its number.
struct Scheduler {
    /// The variable with the task's number.
    index: &'static str,
    /// The number of the first task.
    first: u32,
    /// The variable with the number of tasks, if there is one. (Slurm counts those of the submitted array: fewer if
    /// only some are submitted again.)
    count: Option<&'static str>,
}

/// The known schedulers. The first whose variable is a number is used; Grid Engine's is "undefined" outside arrays.
const SCHEDULERS: [Scheduler; 7] = [
    Scheduler { index: "SLURM_ARRAY_TASK_ID", first: 0, count: Some("SLURM_ARRAY_TASK_COUNT") },
    Scheduler { index: "HQ_TASK_ID", first: 0, count: None },
    Scheduler { index: "AWS_BATCH_JOB_ARRAY_INDEX", first: 0, count: Some("AWS_BATCH_JOB_ARRAY_SIZE") },
    Scheduler { index: "JOB_COMPLETION_INDEX", first: 0, count: None },
    Scheduler { index: "SGE_TASK_ID", first: 1, count: Some("SGE_TASK_LAST") },
    Scheduler { index: "PBS_ARRAY_INDEX", first: 0, count: None },
    // 0 outside arrays.
    Scheduler { index: "LSB_JOBINDEX", first: 1, count: None },
];

/// The largest number of parts: more than anyone has tasks.
const MOST: u32 = 1 << 22;

pub fn parse_shard(text: &str) -> Result<ShardOption, String> {
    let (index, count) = match text.split_once('/') {
        Some((index, count)) => (index, Some(count)),
        None => (text, None),
    };
    let count = count.map(|count| count.parse().ok().filter(|count| (1..=MOST).contains(count)));
    let shard = match (index, count) {
        ("auto", Some(Some(count))) => Some(ShardOption { index: None, count: Some(count) }),
        ("auto", None) => Some(ShardOption { index: None, count: None }),
        (index, Some(Some(count))) => index
            .parse()
            .ok()
            .filter(|index| *index < count)
            .map(|index| ShardOption { index: Some(index), count: Some(count) }),
        _ => None,
    };
    shard.ok_or_else(|| "expected I/N with I from 0 to N - 1, such as 3/64, or auto/N, or auto".into())
}

/// Returns the index of this process among `count` tasks, from 0, by its scheduler's variables, or the reason why it is
/// unknown.
pub fn number_of_task(count: u32) -> Result<u32, String> {
    number_by(Some(count), &|name| std::env::var(name).ok()).map(|[index, _]| index)
}

/// Returns the index of a task and the number of tasks, by a scheduler's variables.
fn number_by(known: Option<u32>, variable: &dyn Fn(&str) -> Option<String>) -> Result<[u32; 2], String> {
    let number = |name: &str| variable(name).and_then(|text| text.trim().parse::<u32>().ok());
    let found = SCHEDULERS.iter().find_map(|scheduler| Some((scheduler, number(scheduler.index)?)));
    let Some((scheduler, number_of_task)) = found else {
        let names: Vec<_> = SCHEDULERS.iter().map(|scheduler| scheduler.index).collect();
        return Err(format!("none of {} is a number: say which", names.join(", ")));
    };
    let Scheduler { index: name, first, .. } = scheduler;
    let count = known
        .or_else(|| number(scheduler.count?))
        .ok_or_else(|| format!("{name} does not say how many there are: auto/N"))?;
    match number_of_task.wrapping_sub(*first) {
        index if index < count => Ok([index, count]),
        _ => {
            let hint = if known.is_none() { ": say how many with auto/N" } else { "" };
            Err(format!("{name} is {number_of_task}, but there are {count}, from {first} on{hint}"))
        }
    }
}

impl ShardOption {
    /// Returns the index of the part and the number of parts.
    pub fn resolve(&self) -> Result<[u32; 2], Failure> {
        self.resolve_by(&|name| std::env::var(name).ok())
    }

    fn resolve_by(&self, variable: &dyn Fn(&str) -> Option<String>) -> Result<[u32; 2], Failure> {
        if let ShardOption { index: Some(index), count: Some(count) } = *self {
            return Ok([index, count]);
        }
        number_by(self.count, variable)
            .map_err(|reason| Failure::command_line(format!("--shard auto: {reason}")))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn resolved(text: &str, variables: &[(&str, &str)]) -> Result<[u32; 2], String> {
        let variable = |name: &str| {
            let found = variables.iter().find(|(known, _)| *known == name);
            found.map(|(_, value)| (*value).to_owned())
        };
        parse_shard(text)?.resolve_by(&variable).map_err(|failure| failure.to_string())
    }

    #[test]
    fn auto_shards_are_read_from_scheduler_variables() {
        assert_eq!(resolved("3/64", &[("SLURM_ARRAY_TASK_ID", "5")]), Ok([3, 64]));
        assert_eq!(resolved("auto/8", &[("SLURM_ARRAY_TASK_ID", "5")]), Ok([5, 8]));
        let slurm = [("SLURM_ARRAY_TASK_ID", "5"), ("SLURM_ARRAY_TASK_COUNT", "6")];
        assert_eq!(resolved("auto", &slurm), Ok([5, 6]));
        assert_eq!(resolved("auto/8", &[("JOB_COMPLETION_INDEX", "0")]), Ok([0, 8]));
        assert_eq!(resolved("auto/8", &[("HQ_TASK_ID", "7")]), Ok([7, 8]));
        let aws = [("AWS_BATCH_JOB_ARRAY_INDEX", "1"), ("AWS_BATCH_JOB_ARRAY_SIZE", "2")];
        assert_eq!(resolved("auto", &aws), Ok([1, 2]));
        let grid_engine = [("SGE_TASK_ID", "8"), ("SGE_TASK_LAST", "8")];
        assert_eq!(resolved("auto", &grid_engine), Ok([7, 8]));
    }

    #[test]
    fn impossible_shards_are_rejected() {
        for wrong in ["", "3", "64/64", "-1/4", "1/0", "auto/", "a/b", "1/99999999"] {
            assert!(parse_shard(wrong).is_err(), "{wrong}");
        }
        assert!(resolved("auto/8", &[("SGE_TASK_ID", "undefined")]).is_err_and(|e| e.contains("say which")));
        assert!(resolved("auto", &[("HQ_TASK_ID", "2")]).is_err_and(|e| e.contains("auto/N")));
        // One task of an array, submitted again on its own.
        let again = [("SLURM_ARRAY_TASK_ID", "3"), ("SLURM_ARRAY_TASK_COUNT", "1")];
        assert!(resolved("auto", &again).is_err_and(|e| e.contains("auto/N")));
    }
}
