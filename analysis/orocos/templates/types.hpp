// {generated}
//
// The types of the library's codels and components.

#pragma once
@if standard

{standard}
@end
@if own

{own}
@end
