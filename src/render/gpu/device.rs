use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use crate::render::{Adapter, AdapterChoice, AdapterKind, RenderError};

/// An adapter that is open, and what went wrong on it since.
#[derive(Debug)]
pub struct Device {
    pub adapter: Adapter,
    pub device: wgpu::Device,
    pub queue: wgpu::Queue,
    failure: Arc<Mutex<Failure>>,
}

#[derive(Debug, Default)]
struct Failure {
    lost: bool,
    /// The first finding.
    finding: Option<String>,
}

/// Every adapter that has a driver, the preferred first.
pub fn adapters() -> Vec<Adapter> {
    found().iter().map(|adapter| described(&adapter.get_info())).collect()
}

fn found() -> Vec<wgpu::Adapter> {
    let backends = wgpu::Backends::PRIMARY;
    let mut wanted = wgpu::InstanceDescriptor::new_without_display_handle();
    wanted.backends = backends;
    // Validation by the driver's own layers is for who debugs drivers.
    wanted.flags = wgpu::InstanceFlags::empty();
    let instance = wgpu::Instance::new(wanted);
    let mut adapters = pollster::block_on(instance.enumerate_adapters(backends));
    adapters.sort_by_key(|adapter| described(&adapter.get_info()).kind);
    adapters
}

fn described(info: &wgpu::AdapterInfo) -> Adapter {
    let kind = match info.device_type {
        wgpu::DeviceType::DiscreteGpu => AdapterKind::Discrete,
        wgpu::DeviceType::IntegratedGpu => AdapterKind::Integrated,
        wgpu::DeviceType::VirtualGpu | wgpu::DeviceType::Other => AdapterKind::Virtual,
        wgpu::DeviceType::Cpu => AdapterKind::Software,
    };
    let driver = [info.backend.to_str(), &info.driver, &info.driver_info];
    let driver = driver.into_iter().filter(|part| !part.is_empty()).collect::<Vec<_>>().join(" ");
    Adapter { name: info.name.clone(), kind, driver }
}

fn chosen(choice: &AdapterChoice, adapters: Vec<wgpu::Adapter>) -> Result<wgpu::Adapter, RenderError> {
    let wanted = match choice {
        AdapterChoice::Named(name) => name.to_lowercase(),
        _ => String::new(),
    };
    let known: Vec<Adapter> = adapters.iter().map(|adapter| described(&adapter.get_info())).collect();
    let has = |adapter: &Adapter| {
        [&adapter.name, &adapter.driver].iter().any(|text| text.to_lowercase().contains(&wanted))
    };
    let Some(index) = known.iter().position(has) else {
        return Err(if known.is_empty() {
            RenderError::NoAdapter
        } else {
            RenderError::NoSuchAdapter { wanted, found: known }
        });
    };
    adapters.into_iter().nth(index).ok_or(RenderError::NoAdapter)
}

impl Device {
    /// Opens the chosen adapter with all that it can.
    ///
    /// # Errors
    /// As [`crate::render::open`].
    pub fn open(choice: &AdapterChoice) -> Result<Self, RenderError> {
        let adapter = chosen(choice, found())?;
        let described = described(&adapter.get_info());
        let wanted = wgpu::DeviceDescriptor { required_limits: adapter.limits(), ..Default::default() };
        let (device, queue) = pollster::block_on(adapter.request_device(&wanted)).map_err(|error| {
            RenderError::Device { adapter: described.to_string(), finding: error.to_string() }
        })?;
        let failure = Arc::new(Mutex::new(Failure::default()));
        let noted = Arc::clone(&failure);
        device.on_uncaptured_error(Arc::new(move |error| note(&noted, false, error.to_string())));
        let noted = Arc::clone(&failure);
        device.set_device_lost_callback(move |_, finding| note(&noted, true, format!("lost: {finding}")));
        Ok(Self { adapter: described, device, queue, failure })
    }

    /// Whether all went well since the last time.
    ///
    /// # Errors
    /// [`RenderError::Device`].
    pub fn check(&self) -> Result<(), RenderError> {
        match locked(&self.failure).finding.take() {
            Some(finding) => Err(RenderError::Device { adapter: self.adapter.to_string(), finding }),
            None => Ok(()),
        }
    }

    /// Whether the device is gone, so that only another one can help.
    pub fn is_lost(&self) -> bool {
        locked(&self.failure).lost
    }

    /// Waits for all that was submitted.
    ///
    /// # Errors
    /// [`RenderError::Device`].
    pub fn wait(&self) -> Result<(), RenderError> {
        let waited = self.device.poll(wgpu::PollType::Wait { submission_index: None, timeout: None });
        if let Err(error) = waited {
            note(&self.failure, false, error.to_string());
        }
        self.check()
    }

    /// Numbers from a buffer that can be mapped.
    ///
    /// # Errors
    /// [`RenderError::Device`].
    pub fn read(&self, buffer: &wgpu::Buffer, numbers: usize) -> Result<Vec<f32>, RenderError> {
        let slice = buffer.slice(..4 * numbers as u64);
        let failure = Arc::clone(&self.failure);
        slice.map_async(wgpu::MapMode::Read, move |mapped| {
            if let Err(error) = mapped {
                note(&failure, false, error.to_string());
            }
        });
        self.wait()?;
        let read = slice.get_mapped_range().map(|bytes| bytemuck::pod_collect_to_vec(&bytes));
        buffer.unmap();
        read.map_err(|error| RenderError::Device {
            adapter: self.adapter.to_string(),
            finding: error.to_string(),
        })
    }
}

fn note(failure: &Mutex<Failure>, lost: bool, finding: String) {
    let mut failure = locked(failure);
    failure.lost |= lost;
    failure.finding.get_or_insert(finding);
}

fn locked(failure: &Mutex<Failure>) -> MutexGuard<'_, Failure> {
    failure.lock().unwrap_or_else(PoisonError::into_inner)
}
