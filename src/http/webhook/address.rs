use std::net::{IpAddr, Ipv4Addr, Ipv6Addr};

use url::{Host, Url};

use crate::http::config::WebhookConfig;
use crate::http::problem::{Kind, Problem};

/// Bytes of an address at most.
const LONGEST: usize = 2000;

/// The address to tell, if it may be told. A host's name is looked up when it is told, and checked again then.
///
/// # Errors
/// [`Kind::InvalidField`] says what is wrong with it.
pub fn check_address(text: &str, config: &WebhookConfig) -> Result<Url, Problem> {
    let refuse =
        |finding: &str, remedy| Err(Problem::of_field(Kind::InvalidField, "webhook", finding, remedy));
    if text.len() > LONGEST {
        return refuse("is longer than 2000 bytes", "give a shorter address");
    }
    let Ok(url) = Url::parse(text) else {
        return refuse("is no address", "give one as https://example.org/hook");
    };
    match url.scheme() {
        "https" => {}
        "http" if config.allow_http => {}
        "http" => return refuse("is not encrypted", "give an https address, or set `webhooks.allow_http`"),
        _ => return refuse("is neither https nor http", "give an https address"),
    }
    if !url.username().is_empty() || url.password().is_some() {
        return refuse("holds a user's name", "leave it out: deliveries are signed");
    }
    let literal = match url.host() {
        Some(Host::Ipv4(ip)) => Some(IpAddr::V4(ip)),
        Some(Host::Ipv6(ip)) => Some(IpAddr::V6(ip)),
        Some(Host::Domain(_)) => None,
        None => return refuse("names no host", "give one as https://example.org/hook"),
    };
    if !config.allow_private_addresses && literal.is_some_and(|ip| !is_public(ip)) {
        let remedy = "give a public address, or set `webhooks.allow_private_addresses`";
        return refuse("is within a private network", remedy);
    }
    Ok(url)
}

/// Whether an address is one of the whole internet.
pub(super) fn is_public(ip: IpAddr) -> bool {
    match ip {
        IpAddr::V4(ip) => is_public_v4(ip),
        IpAddr::V6(ip) => is_public_v6(ip),
    }
}

fn is_public_v4(ip: Ipv4Addr) -> bool {
    let [a, b, c, _] = ip.octets();
    let shared = a == 100 && (64..128).contains(&b);
    let protocols = (a, b, c) == (192, 0, 0);
    let benchmarks = a == 198 && (b == 18 || b == 19);
    let special = ip.is_loopback()
        || ip.is_private()
        || ip.is_link_local()
        || ip.is_multicast()
        || ip.is_documentation();
    !(special || shared || protocols || benchmarks || a == 0 || a >= 240)
}

fn is_public_v6(ip: Ipv6Addr) -> bool {
    let segments = ip.segments();
    let embedded = |high: u16, low: u16| {
        let ([a, b], [c, d]) = (high.to_be_bytes(), low.to_be_bytes());
        is_public_v4(Ipv4Addr::new(a, b, c, d))
    };
    match segments {
        // Mapped, and translated by NAT64: what counts is the address within.
        [0, 0, 0, 0, 0, 0xffff, high, low] | [0x64, 0xff9b, 0, 0, 0, 0, high, low] => embedded(high, low),
        [0x2002, high, low, ..] => embedded(high, low),
        // Teredo's holds another address, obscured.
        [0x2001, 0, ..] | [0x2001, 0xdb8, ..] => false,
        // All that is given out to the internet.
        [first, ..] => first & 0xe000 == 0x2000,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn private_networks_in_every_disguise() {
        let private = [
            "127.0.0.1",
            "10.1.2.3",
            "172.16.0.1",
            "192.168.1.1",
            "169.254.169.254",
            "100.64.0.1",
            "0.0.0.0",
            "224.0.0.1",
            "255.255.255.255",
            "198.18.0.1",
            "192.0.0.8",
            "::1",
            "::",
            "fe80::1",
            "fc00::1",
            "fd12::1",
            "ff02::1",
            "::ffff:127.0.0.1",
            "::ffff:10.0.0.1",
            "64:ff9b::a9fe:a9fe",
            "2002:7f00:1::",
            "2001:db8::1",
            "::127.0.0.1",
        ];
        for ip in private {
            assert!(!is_public(ip.parse().unwrap()), "{ip}");
        }
        for ip in ["1.1.1.1", "93.184.216.34", "100.128.0.1", "2606:4700::1111", "::ffff:1.1.1.1"] {
            assert!(is_public(ip.parse().unwrap()), "{ip}");
        }
    }

    #[test]
    fn addresses_that_may_be_told() {
        let config = WebhookConfig::default();
        let kind = |text: &str| check_address(text, &config).err().map(|problem| problem.kind());
        assert_eq!(kind("https://pipeline.example/hooks?x=1"), None);
        let wrong = [
            "http://pipeline.example/",
            "ftp://pipeline.example/",
            "https://127.0.0.1/",
            "https://[::1]/",
            "nonsense",
            "https://2130706433/",
            "https://0x7f.1/",
            "https://user:secret@pipeline.example/",
            "https://",
        ];
        for text in wrong {
            assert_eq!(kind(text), Some(Kind::InvalidField), "{text}");
        }
        let open = WebhookConfig { allow_private_addresses: true, allow_http: true, ..config };
        assert!(check_address("http://127.0.0.1:9/", &open).is_ok());
    }
}
