//! Pictures with cameras as they come in: a zip, or a form with a field for each file.

use axum::extract::multipart::MultipartError;
use axum::extract::{FromRequest, Multipart, Request};

use super::app::App;
use super::extract::{media_type, unsupported};
use super::problem::{Kind, Problem};
use super::upload::{check_room, form_body, store};
use crate::job::capture::{NewCapture, Role};

/// The fields of a form.
const FIELDS: [(&str, Role); 4] =
    [("capture", Role::Zip), ("cameras", Role::Cameras), ("images", Role::Image), ("masks", Role::Mask)];
/// What zips are called.
const ZIP: [&str; 3] = ["application/zip", "application/x-zip-compressed", "application/octet-stream"];

/// Stores a request's body: a zip, or a form.
///
/// # Errors
/// A [`Problem`]; nothing is kept then.
pub async fn receive_capture(app: &App, request: Request) -> Result<NewCapture, Problem> {
    check_room(app)?;
    let limits = &app.config.limits.capture;
    let mut capture = NewCapture::default();
    match media_type(request.headers()).as_deref() {
        Some("multipart/form-data") => receive_form(app, request, &mut capture).await?,
        Some(found) if ZIP.contains(&found) => {
            let zip = super::upload::receive_file(app, request.into_body(), limits.upload_bytes).await?;
            capture.add(Role::Zip, "", zip)?;
        }
        found => return Err(unsupported(found, &["application/zip", "multipart/form-data"])),
    }
    Ok(capture)
}

async fn receive_form(app: &App, request: Request, capture: &mut NewCapture) -> Result<(), Problem> {
    let limits = &app.config.limits.capture;
    let form = Multipart::from_request(form_body(app, request), app).await;
    let mut form = form.map_err(|error| malformed(error.body_text()))?;
    let broken = |error: MultipartError| malformed(error.body_text());
    while let Some(field) = form.next_field().await.map_err(broken)? {
        let called = field.name().unwrap_or_default().to_owned();
        let Some((_, role)) = FIELDS.into_iter().find(|(name, _)| *name == called) else {
            let remedy = "send capture (a zip), or cameras, images and masks";
            return Err(Problem::of_field(Kind::InvalidField, called, "is no field of this form", remedy));
        };
        let name = field.file_name().unwrap_or_default().to_owned();
        let file = store(app, &called, field, limits.upload_bytes).await?;
        capture.add(role, &name, file)?;
        let over = |what: &str, limit: u64| {
            let finding = format!("has more than {limit} {what}");
            Problem::of_field(Kind::LimitExceeded, "capture", finding, "send fewer or smaller pictures")
        };
        if capture.count() > limits.files {
            return Err(over("files", limits.files as u64));
        }
        if capture.bytes() > limits.bytes {
            return Err(over("bytes", limits.bytes));
        }
    }
    match capture.count() {
        0 => {
            let remedy = "send capture (a zip), or cameras and images";
            Err(Problem::of_field(Kind::InvalidField, "capture", "is missing", remedy))
        }
        _ => Ok(()),
    }
}

fn malformed(error: String) -> Problem {
    Problem::of_field(Kind::BadRequest, "body", error, "send a well-formed multipart/form-data body")
}
