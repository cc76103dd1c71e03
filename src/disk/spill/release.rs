//! The end of scratch files: the driver and the stages say when no one needs them any more.

/// Implements `release` for a struct: the files of the named fields are deleted; those after a semicolon are
/// optional.
#[doc(hidden)]
#[macro_export]
macro_rules! __release {
    ($name:ty: $($field:ident),* $(; $($option:ident),*)?) => {
        impl $name {
            /// Deletes the files that no one needs any more.
            ///
            /// # Errors
            /// [`crate::error::Error::Io`], [`crate::error::Error::Disk`].
            pub fn release(
                &self,
                workspace: &$crate::workspace::Workspace,
            ) -> $crate::error::Result<()> {
                $(self.$field.release(workspace)?;)*
                $($(self.$option.as_ref().map_or(Ok(()), |data| data.release(workspace))?;)*)?
                Ok(())
            }
        }
    };
}
pub use __release as release;
