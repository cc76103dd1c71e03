//! Who may open a folder: the user, the system and administrators, as with mode 0700 elsewhere.
#![allow(
    unsafe_code,
    reason = "the standard library has no functions for access lists"
)]

use super::volume::has_access_lists;
use super::{check, wide};
use std::ffi::c_void;
use std::fs::Metadata;
use std::io;
use std::path::Path;
use std::ptr::null_mut;
use windows_sys::Win32::Foundation::{CloseHandle, LocalFree};
use windows_sys::Win32::Security::Authorization::{
    ConvertSidToStringSidW, ConvertStringSecurityDescriptorToSecurityDescriptorW,
    GetNamedSecurityInfoW, SDDL_REVISION_1, SE_FILE_OBJECT,
};
use windows_sys::Win32::Security::{
    ACCESS_ALLOWED_ACE, ACE_HEADER, ACL, DACL_SECURITY_INFORMATION, EqualSid, GetAce,
    GetTokenInformation, INHERIT_ONLY_ACE, IsWellKnownSid, OWNER_SECURITY_INFORMATION, PSID,
    SECURITY_ATTRIBUTES, TOKEN_QUERY, TOKEN_USER, TokenUser, WinBuiltinAdministratorsSid,
    WinCreatorOwnerRightsSid, WinCreatorOwnerSid, WinLocalSystemSid,
};
use windows_sys::Win32::Storage::FileSystem::CreateDirectoryW;
use windows_sys::Win32::System::SystemServices::{ACCESS_ALLOWED_ACE_TYPE, ACCESS_DENIED_ACE_TYPE};
use windows_sys::Win32::System::Threading::{GetCurrentProcess, OpenProcessToken};

/// Memory that the system allocated for an answer.
struct Answer(*mut c_void);

impl Drop for Answer {
    fn drop(&mut self) {
        // SAFETY: the system allocated it, for the caller to free.
        unsafe { LocalFree(self.0) };
    }
}

/// The user of this process, as the system keeps it.
struct User(Vec<u64>);

impl User {
    fn of_process() -> io::Result<Self> {
        let mut token = null_mut();
        // SAFETY: the answer has the room of a handle, which is closed below.
        check(unsafe { OpenProcessToken(GetCurrentProcess(), TOKEN_QUERY, &raw mut token) })?;
        // Words, so that it is aligned; no user takes more than 256 bytes.
        let mut words = vec![0u64; 64];
        let (to, bytes) = (words.as_mut_ptr().cast(), size_of_val(&words[..]) as u32);
        let mut used = 0;
        // SAFETY: the answer has the room that is told.
        let told =
            check(unsafe { GetTokenInformation(token, TokenUser, to, bytes, &raw mut used) });
        // SAFETY: nobody else has this handle.
        unsafe { CloseHandle(token) };
        told.map(|()| Self(words))
    }

    fn sid(&self) -> PSID {
        // SAFETY: the system put this structure at the beginning of the words; its pointer leads into them.
        unsafe { (*self.0.as_ptr().cast::<TOKEN_USER>()).User.Sid }
    }

    /// As text, such as S-1-5-21-1-2-3-1000.
    fn text(&self) -> io::Result<String> {
        let mut text = null_mut();
        // SAFETY: the user is whole, and the answer has the room of a pointer.
        check(unsafe { ConvertSidToStringSidW(self.sid(), &raw mut text) })?;
        let _freed = Answer(text.cast());
        // SAFETY: the text ends in 0, and is there until it is freed.
        let units = unsafe {
            let length = (0..).find(|at| *text.add(*at) == 0).unwrap_or(0);
            std::slice::from_raw_parts(text, length)
        };
        Ok(String::from_utf16_lossy(units))
    }

    /// True for the user, and for those who may do everything on this machine.
    fn is_trusted(&self, sid: PSID) -> bool {
        let known = [
            WinLocalSystemSid,
            WinBuiltinAdministratorsSid,
            WinCreatorOwnerSid,
            WinCreatorOwnerRightsSid,
        ];
        // SAFETY: both are whole.
        unsafe {
            EqualSid(sid, self.sid()) != 0
                || known.iter().any(|known| IsWellKnownSid(sid, *known) != 0)
        }
    }

    /// True if nobody else is in the list.
    ///
    /// # Safety
    /// `list` leads to a whole list, or is null.
    unsafe fn is_alone_in(&self, list: *const ACL) -> bool {
        // Without a list everybody may do everything.
        if list.is_null() {
            return false;
        }
        // SAFETY: the list is whole, so each of its entries is, and begins with its head.
        unsafe {
            (0..u32::from((*list).AceCount)).all(|number| {
                let mut entry = null_mut();
                if GetAce(list, number, &raw mut entry) == 0 {
                    return false;
                }
                let head = &*entry.cast::<ACE_HEADER>();
                match u32::from(head.AceType) {
                    _ if u32::from(head.AceFlags) & INHERIT_ONLY_ACE != 0 => true,
                    ACCESS_DENIED_ACE_TYPE => true,
                    ACCESS_ALLOWED_ACE_TYPE => {
                        let entry = entry.cast::<ACCESS_ALLOWED_ACE>();
                        self.is_trusted((&raw mut (*entry).SidStart).cast())
                    }
                    _ => false,
                }
            })
        }
    }
}

/// The list: the user (`{}`), the system and administrators may do everything, also with what is in the folder;
/// nothing is inherited from above.
fn list_for(user: &str) -> String {
    let one = |who: &str| format!("(A;OICI;FA;;;{who})");
    format!("D:P{}{}{}", one(user), one("SY"), one("BA"))
}

pub fn make_private_folder(path: &Path) -> io::Result<()> {
    let list = list_for(&User::of_process()?.text()?);
    let list: Vec<u16> = list.encode_utf16().chain([0]).collect();
    let mut made = null_mut();
    // SAFETY: the text ends in 0, the answer has the room of a pointer, and its size is not wanted.
    check(unsafe {
        ConvertStringSecurityDescriptorToSecurityDescriptorW(
            list.as_ptr(),
            SDDL_REVISION_1,
            &raw mut made,
            null_mut(),
        )
    })?;
    let made = Answer(made);
    let attributes = SECURITY_ATTRIBUTES {
        nLength: size_of::<SECURITY_ATTRIBUTES>() as u32,
        lpSecurityDescriptor: made.0,
        bInheritHandle: 0,
    };
    let path = wide(path)?;
    // SAFETY: the path ends in 0, and the attributes are whole until the call returns.
    check(unsafe { CreateDirectoryW(path.as_ptr(), &raw const attributes) })
}

/// On a volume without access lists nobody can have a folder for himself, and everyone who may use the volume is
/// trusted.
pub fn is_private(path: &Path, about: &Metadata) -> io::Result<bool> {
    if about.is_symlink() {
        return Ok(false);
    }
    if !has_access_lists(path) {
        return Ok(true);
    }
    let user = User::of_process()?;
    let (wide, (mut owner, mut list, mut whole)) =
        (wide(path)?, (null_mut(), null_mut(), null_mut()));
    let wanted = OWNER_SECURITY_INFORMATION | DACL_SECURITY_INFORMATION;
    // SAFETY: the path ends in 0, and each answer has the room of a pointer.
    let failed = unsafe {
        GetNamedSecurityInfoW(
            wide.as_ptr(),
            SE_FILE_OBJECT,
            wanted,
            &raw mut owner,
            null_mut(),
            &raw mut list,
            null_mut(),
            &raw mut whole,
        )
    };
    if failed != 0 {
        return Err(io::Error::from_raw_os_error(failed.cast_signed()));
    }
    let _freed = Answer(whole);
    // SAFETY: owner and list are parts of what the system returned, which is there until it is freed.
    Ok(user.is_trusted(owner) && unsafe { user.is_alone_in(list) })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_user_is_known() {
        let user = User::of_process().unwrap();
        let text = user.text().unwrap();
        assert!(text.starts_with("S-1-5-"), "{text}");
        assert!(user.is_trusted(user.sid()));
        assert_eq!(
            list_for("S-1-5-9"),
            "D:P(A;OICI;FA;;;S-1-5-9)(A;OICI;FA;;;SY)(A;OICI;FA;;;BA)"
        );
    }
}
