/// Times kernels and stages.
#[derive(Debug, clap::Args)]
pub struct Bench {}

impl Bench {
    /// Does it.
    pub fn run(self) -> anyhow::Result<()> {
        Ok(())
    }
}
