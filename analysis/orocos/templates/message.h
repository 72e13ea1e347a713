// {mark}: do not change this file.
//
// The message {of}/{name}, with the fields of the header of ROS {ros}.

#pragma once
@if standard

{standard}
@end
@if own

{own}
@end

namespace {of} {

@if body
struct {name} {
{body}
};
@else
struct {name} {};
@end
@if visit

// Lists the fields for whatever writes or reads samples of a topic.
template <class Stream>
void visit(Stream& stream, {name}&{message}) {
{visit}
}

// Its name in ROS 2.
namespace msg {
using ::{of}::{name};
}
@end

}  // namespace {of}
