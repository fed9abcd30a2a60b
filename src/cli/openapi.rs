/// Prints the OpenAPI document of the service.
#[derive(Debug, clap::Args)]
pub struct Openapi {}

impl Openapi {
    /// Does it.
    pub fn run(self) -> anyhow::Result<()> {
        say!("{}", onemesh::http::openapi_json().trim_end());
        Ok(())
    }
}
