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
@if visit

#ifdef MAUVE_ROS2_MESSAGES
#include <{installed}>
#endif
@end

namespace {of} {
@if visit
namespace msg {

#ifndef MAUVE_ROS2_MESSAGES
@else

@end
@if body
struct {name} {
{body}
};
@else
struct {name} {};
@end
@if visit
#endif

// Lists the fields for whatever writes or reads samples of a topic.
template <class Stream>
void visit(Stream& stream, {name}&{message}) {
{visit}
}

}  // namespace msg

using msg::{name};
@end

}  // namespace {of}
