use anyhow::Context;

/// How many threads work.
#[derive(Debug, clap::Args)]
pub struct Threads {
    /// Threads to work with; one for each processor unless said. Results do not depend on it
    #[arg(long, global = true, value_name = "N")]
    threads: Option<usize>,
}

impl Threads {
    /// Sets the number for the whole program.
    pub fn apply(&self) -> anyhow::Result<()> {
        let Some(threads) = self.threads else {
            return Ok(());
        };
        anyhow::ensure!((1..=1024).contains(&threads), "--threads {threads}: choose 1 to 1024");
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads);
        pool.build_global().with_context(|| format!("cannot start {threads} threads"))
    }
}
