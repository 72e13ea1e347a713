//! How a client keeps values of figures that have no such form of their own: names as texts, times as nanoseconds.

use mauve_hir::item_tree::Name;
use mauve_timing::{Priority, Status, Time};
use serde::de::{DeserializeOwned, Error as _};
use serde::{Deserialize as _, Deserializer, Serialize, Serializer};

/// A value with a form that can be kept.
pub(super) trait Kept: Sized {
    type Form: Serialize + DeserializeOwned;

    fn form(&self) -> Self::Form;

    /// Returns the value of a form, if it has one.
    fn of(form: Self::Form) -> Option<Self>;
}

pub(super) fn serialize<T: Kept, S: Serializer>(value: &T, to: S) -> Result<S::Ok, S::Error> {
    value.form().serialize(to)
}

pub(super) fn deserialize<'de, T: Kept, D: Deserializer<'de>>(from: D) -> Result<T, D::Error> {
    T::of(T::Form::deserialize(from)?).ok_or_else(|| D::Error::custom("no such value"))
}

impl Kept for Name {
    type Form = String;

    fn form(&self) -> String {
        self.to_string()
    }

    fn of(form: String) -> Option<Name> {
        Some(Name::from(form))
    }
}

impl Kept for String {
    type Form = String;

    fn form(&self) -> String {
        self.clone()
    }

    fn of(form: String) -> Option<String> {
        Some(form)
    }
}

impl Kept for Time {
    type Form = u64;

    fn form(&self) -> u64 {
        self.as_nanos()
    }

    fn of(form: u64) -> Option<Time> {
        Some(Time::from_nanos(form))
    }
}

impl Kept for Status {
    type Form = String;

    fn form(&self) -> String {
        self.name().to_owned()
    }

    fn of(form: String) -> Option<Status> {
        use Status::{Background, Met, Missed, NoBound, NotAnalysed, Unbounded};
        let all = [Met, Missed, Unbounded, NoBound, NotAnalysed, Background];
        all.into_iter().find(|it| it.name() == form)
    }
}

/// A number; −1 in the background, −2 if unknown.
impl Kept for Priority {
    type Form = i64;

    fn form(&self) -> i64 {
        match self {
            Priority::RealTime(priority) => i64::from(*priority),
            Priority::Background => -1,
            Priority::Unknown => -2,
        }
    }

    fn of(form: i64) -> Option<Priority> {
        match form {
            -1 => Some(Priority::Background),
            -2 => Some(Priority::Unknown),
            number => u32::try_from(number).ok().map(Priority::RealTime),
        }
    }
}

impl<T: Kept> Kept for Option<T> {
    type Form = Option<T::Form>;

    fn form(&self) -> Self::Form {
        self.as_ref().map(T::form)
    }

    fn of(form: Self::Form) -> Option<Option<T>> {
        form.map_or(Some(None), |form| T::of(form).map(Some))
    }
}

impl<T: Kept> Kept for Vec<T> {
    type Form = Vec<T::Form>;

    fn form(&self) -> Self::Form {
        self.iter().map(T::form).collect()
    }

    fn of(form: Self::Form) -> Option<Vec<T>> {
        form.into_iter().map(T::of).collect()
    }
}

impl<T: Kept> Kept for [T; 2] {
    type Form = [T::Form; 2];

    fn form(&self) -> Self::Form {
        self.each_ref().map(T::form)
    }

    fn of([one, other]: Self::Form) -> Option<[T; 2]> {
        Some([T::of(one)?, T::of(other)?])
    }
}

impl<A: Kept, B: Kept> Kept for (A, B) {
    type Form = (A::Form, B::Form);

    fn form(&self) -> Self::Form {
        (self.0.form(), self.1.form())
    }

    fn of((one, other): Self::Form) -> Option<(A, B)> {
        Some((A::of(one)?, B::of(other)?))
    }
}
