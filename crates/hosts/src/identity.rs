//! Identities: certificates by which hosts and callers know each other, and the authorities that issue them.
//!
//! In: a name, an authority. Out: a certificate with its key, in PEM files that only their owner reads. Never here: the rights of callers
//! ([`crate::serving`]), a connection.

use crate::error::HostsError;
use base64::Engine as _;
use rcgen::{
    BasicConstraints, CertificateParams, DistinguishedName, DnType, ExtendedKeyUsagePurpose, IsCa, Issuer, KeyPair,
    KeyUsagePurpose,
};
use std::io::Write;
use std::net::IpAddr;
use std::path::Path;
use time::{Duration, OffsetDateTime};
use x509_parser::prelude::{FromDer, X509Certificate};

/// For so long an authority is valid.
const AUTHORITY_LASTS: Duration = Duration::days(3650);
/// A certificate is valid from so long ago on: clocks of a laboratory differ.
const BEFORE: Duration = Duration::days(1);

/// A certificate with its key, and the certificate of the authority by which others are known: one PEM file.
#[derive(Clone)]
pub struct Identity {
    name: String,
    certificate: String,
    key: String,
    authority: String,
}

/// A certificate that others are issued by, with its key: one PEM file. Its holder can issue any name.
pub struct Authority {
    certificate: String,
    key: String,
}

impl std::fmt::Debug for Identity {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Identity").field("name", &self.name).finish_non_exhaustive()
    }
}

impl Identity {
    /// The identity in a file of [`Identity::write`].
    ///
    /// # Errors
    /// [`HostsError::BadIdentity`]: a file that cannot be read or holds something else, and a certificate whose days are over.
    pub fn from_file(path: impl AsRef<Path>) -> Result<Self, HostsError> {
        let path = path.as_ref();
        let bad = |reason: String| HostsError::BadIdentity { file: path.display().to_string(), reason };
        let text = std::fs::read_to_string(path).map_err(|error| bad(error.to_string()))?;
        let certificates = blocks(&text, "CERTIFICATE");
        let keys = blocks(&text, "PRIVATE KEY");
        let ([own, authority], [key]) = (&*certificates, &*keys) else {
            let (certificates, keys) = (certificates.len(), keys.len());
            let wanted =
                "expected its certificate, its key and its authority's certificate, as of `metachron identity new`";
            return Err(bad(format!("it has {certificates} certificates and {keys} keys; {wanted}")));
        };
        let (name, ends) =
            holder(own).ok_or_else(|| bad("its certificate has no name that a caller can have".to_owned()))?;
        if ends < OffsetDateTime::now_utc() {
            return Err(bad(format!("its certificate ended on {}", ends.date())));
        }
        Ok(Self { name, certificate: own.clone(), key: key.clone(), authority: authority.clone() })
    }

    /// Writes it to a file that no other user may read.
    ///
    /// # Errors
    /// [`HostsError::BadIdentity`], also where there is such a file.
    pub fn write(&self, path: impl AsRef<Path>) -> Result<(), HostsError> {
        write_new(path.as_ref(), &[&self.certificate, &self.key, &self.authority])
    }

    /// The common name of its certificate.
    #[must_use]
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Certificate, key and authority as zenoh's configuration takes them.
    pub(crate) fn in_base64(&self) -> [String; 3] {
        [&self.certificate, &self.key, &self.authority].map(|pem| base64::engine::general_purpose::STANDARD.encode(pem))
    }
}

impl Authority {
    /// A new one, valid for ten years.
    ///
    /// # Errors
    /// [`HostsError::BadIdentity`] where the system gives no random numbers.
    pub fn new(name: &str) -> Result<Self, HostsError> {
        let made = || -> Result<Self, rcgen::Error> {
            let mut params = params(name, OffsetDateTime::now_utc() + AUTHORITY_LASTS);
            params.is_ca = IsCa::Ca(BasicConstraints::Constrained(0));
            params.key_usages = vec![KeyUsagePurpose::KeyCertSign, KeyUsagePurpose::CrlSign];
            let key = KeyPair::generate()?;
            Ok(Self { certificate: params.self_signed(&key)?.pem(), key: key.serialize_pem() })
        };
        made().map_err(|error| HostsError::BadIdentity { file: name.to_owned(), reason: error.to_string() })
    }

    /// The authority in a file of [`Authority::write`].
    ///
    /// # Errors
    /// [`HostsError::BadIdentity`].
    pub fn from_file(path: impl AsRef<Path>) -> Result<Self, HostsError> {
        let path = path.as_ref();
        let bad = |reason: String| HostsError::BadIdentity { file: path.display().to_string(), reason };
        let text = std::fs::read_to_string(path).map_err(|error| bad(error.to_string()))?;
        match (&*blocks(&text, "CERTIFICATE"), &*blocks(&text, "PRIVATE KEY")) {
            ([certificate], [key]) => Ok(Self { certificate: certificate.clone(), key: key.clone() }),
            (certificates, keys) => {
                let (certificates, keys) = (certificates.len(), keys.len());
                Err(bad(format!(
                    "it has {certificates} certificates and {keys} keys; expected an authority's one of each"
                )))
            }
        }
    }

    /// Writes it to a file that no other user may read.
    ///
    /// # Errors
    /// [`HostsError::BadIdentity`], also where there is such a file.
    pub fn write(&self, path: impl AsRef<Path>) -> Result<(), HostsError> {
        write_new(path.as_ref(), &[&self.certificate, &self.key])
    }

    /// An identity of that name, 1 to 64 of a to z, A to Z, 0 to 9, _ and -, for `days` from now. Callers reach a host with it by its name, and
    /// at `addresses`: names of DNS and IP addresses.
    ///
    /// # Errors
    /// [`HostsError::BadName`], [`HostsError::BadAddress`], and [`HostsError::BadIdentity`] for an end beyond the year 9999, or an authority that
    /// can issue nothing.
    pub fn issue(&self, name: &str, addresses: &[String], days: i64) -> Result<Identity, HostsError> {
        if !is_name(name) {
            return Err(HostsError::BadName { name: name.to_owned() });
        }
        if let Some(address) = addresses.iter().find(|address| !is_address(address)) {
            return Err(HostsError::BadAddress { address: address.clone() });
        }
        let bad = |reason: String| HostsError::BadIdentity { file: name.to_owned(), reason };
        let ends =
            end_after(days).ok_or_else(|| bad(format!("{days} days from now is no day of the years to 9999")))?;
        let made = || -> Result<Identity, rcgen::Error> {
            let issuer = Issuer::from_ca_cert_pem(&self.certificate, KeyPair::from_pem(&self.key)?)?;
            let reached: Vec<_> = std::iter::once(name.to_owned()).chain(addresses.iter().cloned()).collect();
            let subject_alt_names = CertificateParams::new(reached)?.subject_alt_names;
            let mut params = params(name, ends);
            params.subject_alt_names = subject_alt_names;
            params.key_usages = vec![KeyUsagePurpose::DigitalSignature];
            params.extended_key_usages = vec![ExtendedKeyUsagePurpose::ServerAuth, ExtendedKeyUsagePurpose::ClientAuth];
            params.use_authority_key_identifier_extension = true;
            let key = KeyPair::generate()?;
            let certificate = params.signed_by(&key, &issuer)?.pem();
            let (name, authority) = (name.to_owned(), self.certificate.clone());
            Ok(Identity { name, certificate, key: key.serialize_pem(), authority })
        };
        made().map_err(|error| bad(error.to_string()))
    }
}

/// The moment so many days from now; `None` beyond the year 9999.
fn end_after(days: i64) -> Option<OffsetDateTime> {
    OffsetDateTime::now_utc().checked_add(Duration::seconds(days.checked_mul(86_400)?))
}

/// The part that all certificates of a name share.
fn params(name: &str, ends: OffsetDateTime) -> CertificateParams {
    let mut params = CertificateParams::default();
    params.distinguished_name = DistinguishedName::new();
    params.distinguished_name.push(DnType::CommonName, name);
    params.not_before = OffsetDateTime::now_utc() - BEFORE;
    params.not_after = ends.max(params.not_before);
    params
}

/// Whether this names a world, a session or the holder of a certificate: a part of keys.
pub(crate) fn is_name(name: &str) -> bool {
    (1..=64).contains(&name.len()) && name.bytes().all(|byte| byte.is_ascii_alphanumeric() || b"_-".contains(&byte))
}

/// Whether this is an IP address, or a name of DNS: labels of letters, digits, - and _, the last one no number.
fn is_address(address: &str) -> bool {
    let is_label = |label: &str| is_name(label) && label.len() < 64 && !label.starts_with('-') && !label.ends_with('-');
    let is_dns = address.len() < 254
        && address.split('.').all(is_label)
        && !address.rsplit('.').next().is_some_and(|last| last.bytes().all(|byte| byte.is_ascii_digit()));
    is_dns || address.parse::<IpAddr>().is_ok()
}

/// The blocks of that label in the text of a PEM file.
fn blocks(text: &str, label: &str) -> Vec<String> {
    let (begin, end) = (format!("-----BEGIN {label}-----"), format!("-----END {label}-----"));
    let after = text.split(&*begin).skip(1);
    after.filter_map(|block| block.split_once(&*end).map(|(inner, _)| format!("{begin}{inner}{end}\n"))).collect()
}

/// The name of a certificate's holder, and when it ends.
fn holder(certificate: &str) -> Option<(String, OffsetDateTime)> {
    let (_, pem) = x509_parser::pem::parse_x509_pem(certificate.as_bytes()).ok()?;
    let (_, parsed) = X509Certificate::from_der(&pem.contents).ok()?;
    let name = parsed.subject().iter_common_name().next()?.as_str().ok()?.to_owned();
    is_name(&name).then_some((name, parsed.validity().not_after.to_datetime()))
}

fn write_new(path: &Path, blocks: &[&str]) -> Result<(), HostsError> {
    let mut options = std::fs::OpenOptions::new();
    options.write(true).create_new(true);
    #[cfg(unix)]
    std::os::unix::fs::OpenOptionsExt::mode(&mut options, 0o600);
    let written =
        options.open(path).and_then(|mut file| blocks.iter().try_for_each(|block| file.write_all(block.as_bytes())));
    written.map_err(|error| HostsError::BadIdentity { file: path.display().to_string(), reason: error.to_string() })
}
