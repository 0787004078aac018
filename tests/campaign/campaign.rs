//! The blind campaign: hides effects in a plant of its own, writes logs in the form of the development cases,
//! asks `rotorbench diagnose` about them and keeps the score.
//!
//! `campaign generate --out DIR [--draws 20] [--seed 1]`, `campaign score DIR [--binary PATH] [--jobs 2]`

#[cfg(test)]
mod agreement;
mod answer;
mod between_rows;
mod case;
mod catalogue;
#[cfg(test)]
mod claims;
#[cfg(test)]
mod compare;
mod discovered;
mod experiment;
mod form;
mod goals;
mod law_score;
mod laws;
mod motion;
mod noise;
mod outside;
mod plant;
mod score;
mod strength;
#[cfg(test)]
mod tests;
#[cfg(test)]
mod verify;

use std::error::Error;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::Parser;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use serde_json::{Map, Value};

use case::{CHANGES, Question};
use catalogue::Kind;
use outside::{OUTSIDE_ACTUATOR, OUTSIDE_ATTITUDE};

#[derive(Parser)]
enum CommandLine {
    /// Write cases and their truth
    Generate {
        /// Folder to write into
        #[arg(long)]
        out: PathBuf,
        /// Cases of each effect on each bench where it shows
        #[arg(long, default_value_t = 20)]
        draws: u64,
        /// First seeds: the cases of all of them, each as it is when drawn alone
        #[arg(long, default_value = "1", value_delimiter = ',')]
        seed: Vec<u64>,
        /// Laws with a formula and what may be taken for one, for `discover`, and nothing else
        #[arg(long, group = "only")]
        discover: bool,
        /// With --discover: on benches of other numbers than the paper's, in logs as poor as telemetry is
        #[arg(long, requires = "discover")]
        poor: bool,
        /// That many cases of an effect beside a small one that nobody names, and nothing else
        #[arg(long, group = "only")]
        blurred: Option<u64>,
        /// That many cases whose battery is read in steps of 0.05 or 0.1 V, and nothing else
        #[arg(long, group = "only")]
        coarse_battery: Option<u64>,
        /// That many cases of three effects in one block, and nothing else
        #[arg(long, group = "only")]
        three: Option<u64>,
        /// That many cases of nothing but noise that is not white, and nothing else
        #[arg(long, group = "only")]
        noisy: Option<u64>,
        /// That many benches of which the program makes the base itself, and nothing else
        #[arg(long, group = "only")]
        own_base: Option<u64>,
        /// That many benches whose commands step between the rows of their logs, and nothing else
        #[arg(long, group = "only")]
        between_rows: Option<u64>,
    },
    /// Ask the program about every case of a folder, and print the score
    Score {
        /// Folder with `truth.json`
        folder: PathBuf,
        /// The program
        #[arg(long, default_value = "target/release/rotorbench")]
        binary: PathBuf,
        /// Diagnoses at a time
        #[arg(long, default_value_t = 2)]
        jobs: usize,
        /// Only cases whose truth contains this
        #[arg(long)]
        only: Option<String>,
        /// Ask `discover` for the law
        #[arg(long)]
        discover: bool,
        /// Leave the line for each case out
        #[arg(long)]
        brief: bool,
    },
}

fn main() -> ExitCode {
    let done = match CommandLine::parse() {
        CommandLine::Generate { out, seed, between_rows: Some(count), .. } => {
            generate_between_rows(&out, &seed, count).map(|()| true)
        }
        CommandLine::Generate {
            out,
            draws,
            seed,
            discover,
            poor,
            blurred,
            coarse_battery,
            three,
            noisy,
            own_base,
            ..
        } => {
            let drawn = seed.iter().map(|seed| {
                let mut rng = ChaCha8Rng::seed_from_u64(*seed);
                let asked: Vec<Question> = match (blurred, coarse_battery, three, noisy, own_base) {
                    (Some(count), ..) => (0..count)
                        .map(|_| Question::OtherBench(Box::new(Question::blurred(&mut rng)), None))
                        .collect(),
                    (_, Some(count), ..) => {
                        (0..count).map(|number| Question::coarse(number, &mut rng)).collect()
                    }
                    (_, _, Some(count), ..) => (0..count).map(|_| Question::three(&mut rng)).collect(),
                    (_, _, _, Some(count), _) => (0..count)
                        .map(|number| Question::OtherBench(Box::new(Question::flawed(number)), None))
                        .collect(),
                    (.., Some(count)) => {
                        (0..count).map(|number| Question::own_base(number, &mut rng)).collect()
                    }
                    _ if poor => discovered::poor(draws),
                    _ if discover => discovered::questions(draws),
                    _ => questions(draws, *seed),
                };
                (*seed, asked)
            });
            generate(&out, drawn).map(|()| true)
        }
        CommandLine::Score { folder, binary, jobs, only, discover: true, brief } => {
            discovered::score(&folder, &binary, jobs.max(1), only.as_deref(), brief)
        }
        CommandLine::Score { folder, binary, jobs, only, brief, .. } => {
            score(&folder, &binary, jobs.max(1), only.as_deref(), brief)
        }
    };
    match done {
        Ok(true) => ExitCode::SUCCESS,
        Ok(false) => ExitCode::from(1),
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::from(2)
        }
    }
}

/// Everything a campaign of `draws` asks: each single effect, as many pairs, nothing, changes, strangers.
fn questions(draws: u64, seed: u64) -> Vec<Question> {
    let mut out = Vec::new();
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    for _ in 0..draws {
        out.extend(Question::singles());
        out.extend((0..6).map(|_| Question::pair(&mut rng)));
        for kind in [Kind::Actuator, Kind::Attitude] {
            out.extend([Question::Nothing(kind), Question::Nothing(kind), Question::Nothing(kind)]);
        }
        out.extend(CHANGES.iter().map(|(name, kind)| Question::Changed(name, *kind)));
        out.extend((0..OUTSIDE_ACTUATOR).map(|number| Question::Outside(number, Kind::Actuator)));
        out.extend((0..OUTSIDE_ATTITUDE).map(|number| Question::Outside(number, Kind::Attitude)));
    }
    // Behind all others: a seed's cases stay what they were before these were asked.
    (0..draws).for_each(|_| out.extend(Question::sags()));
    out
}

/// Writes what was asked, seed after seed.
fn generate(out: &Path, drawn: impl IntoIterator<Item = (u64, Vec<Question>)>) -> Result<(), Box<dyn Error>> {
    fs::create_dir_all(out)?;
    let mut truths = Map::new();
    for (seed, questions) in drawn {
        for (number, question) in questions.iter().enumerate() {
            let Some(case) = question.make(seed.wrapping_mul(1_000_003) + number as u64) else { continue };
            let name = format!("case_{:04}", truths.len());
            case.write(&out.join(&name))?;
            truths.insert(name, case.truth);
        }
    }
    fs::write(out.join("truth.json"), serde_json::to_string_pretty(&Value::Object(truths))?)?;
    Ok(())
}

/// Writes benches whose commands step between rows, seed after seed.
fn generate_between_rows(out: &Path, seeds: &[u64], count: u64) -> Result<(), Box<dyn Error>> {
    fs::create_dir_all(out)?;
    let mut truths = Map::new();
    for (seed, number) in seeds.iter().flat_map(|seed| (0..count).map(move |number| (seed, number))) {
        let case = between_rows::Case::draw(number, seed.wrapping_mul(1_000_003) + number);
        let name = format!("case_{:04}", truths.len());
        case.write(&out.join(&name))?;
        truths.insert(name, case.truth);
    }
    fs::write(out.join("truth.json"), serde_json::to_string_pretty(&Value::Object(truths))?)?;
    Ok(())
}

fn score(
    folder: &Path,
    binary: &Path,
    jobs: usize,
    only: Option<&str>,
    brief: bool,
) -> Result<bool, Box<dyn Error>> {
    let counts =
        |truth: &Value| only.is_none_or(|only| truth["effect"].as_str().is_some_and(|e| e.contains(only)));
    let judge = |name: &str, truth: &Value, answer: &answer::Answer| {
        let one = score::judge(name, truth, answer);
        eprintln!("{name} {}: {:?}, {}", one.truth, one.mark, one.said);
        Some(one)
    };
    let judged = answer::ask_all((folder, binary, jobs), "diagnose", counts, judge)?;
    if !brief {
        println!("{}", score::case_table(&judged));
    }
    let (goals, reached) = goals::goals(&judged);
    println!("{}\n{goals}", score::summary_table(&judged));
    Ok(reached)
}
