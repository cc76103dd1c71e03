//! The service at which a machine in the cloud asks for its own role: that of Amazon, Google and Azure has one address.

use std::net::{SocketAddr, TcpStream};
use std::sync::OnceLock;
use std::time::Duration;

/// The address of the service.
const METADATA: ([u8; 4], u16) = ([169, 254, 169, 254], 80);

/// How long that address may take to accept a connection: it is on the same machine.
const NEAR: Duration = Duration::from_millis(300);

/// True if this machine has a role that it can ask for. It is looked for once.
pub(crate) fn has_metadata() -> bool {
    static FOUND: OnceLock<bool> = OnceLock::new();
    let disabled = std::env::var("AWS_EC2_METADATA_DISABLED").is_ok_and(|v| v == "true");
    let look = || TcpStream::connect_timeout(&SocketAddr::from(METADATA), NEAR).is_ok();
    !disabled && *FOUND.get_or_init(look)
}
