//! Requests that come in two forms: a body of JSON, or parameters beside points as bytes.

/// Declares the two forms of a request: the fields that each has for itself, and after them those of `both`. A new
/// option of the request is a field of `both`.
///
/// `as` names the type that describes a field, `where required = false` one that may be left out.
macro_rules! two_forms {
    (
        $(#[$of_body:meta])*
        body $Body:ident { $($own:tt)* }
        $(#[$of_params:meta])*
        params $Params:ident { $($beside:tt)* }
        both {
            $($(#[$of_field:meta])* $field:ident: $Field:ty $(as $Described:ty)? $(where required = $required:literal)?,)*
        }
    ) => {
        #[derive(serde::Deserialize, utoipa::ToSchema)]
        $(#[$of_body])*
        #[serde(deny_unknown_fields)]
        pub(crate) struct $Body {
            $($own)*
            $(
                $(#[$of_field])*
                $(#[schema(value_type = $Described)])?
                $(#[schema(required = $required)])?
                $field: $Field,
            )*
        }

        #[derive(serde::Deserialize, utoipa::IntoParams)]
        $(#[$of_params])*
        #[serde(deny_unknown_fields)]
        #[into_params(parameter_in = Query)]
        pub(crate) struct $Params {
            $($beside)*
            $(
                $(#[$of_field])*
                $(#[param(value_type = $Described, inline)])?
                $(#[param(required = $required)])?
                $field: $Field,
            )*
        }
    };
}

pub(in crate::http) use two_forms;
