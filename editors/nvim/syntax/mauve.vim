" Colours for MAUVE. The language server adds what depends on names.
"
" Every keyword is contextual: a port may be called `state`, and a state `start`. So a keyword is matched with what must
" follow it, and takes its name with it (nextgroup), whatever the name is.

if exists('b:current_syntax')
  finish
endif

" Anywhere in a program. What is defined later is tried first.
syn match mauveCall /\h\w*\ze\s*(/
syn match mauveBuiltin /\.\@1<!\<\%(read\|write\|status\|send\|collect\)\ze\s*(/
syn match mauveOperator /->\|&&\|||\|[!=<>]=\|[-+*%=<>!]\|\/[/*]\@!/
syn match mauveNumber /\<\%(0[xX]\x\+\|\d\+\%(\.\d\+\)\=\%([eE][-+]\=\d\+\)\=\)\>/
syn keyword mauveBoolean true false
syn keyword mauveStatus no_data old_data new_data failure success not_ready
syn match mauveConditional /\.\@1<!\<if\>\%(\s*=[^=]\)\@!/
syn match mauveConditional /\<then\ze\%(\s*{\|\s*$\)/
syn match mauveConditional /\<else\ze\%(\s*{\|\s\+if\>\|\s*$\)/
syn match mauveStatement /\.\@1<!\<return\>\%(\s*=[^=]\)\@!/

" A member, so that none is taken for a keyword: switch.state
syn match mauveMember /\.\s*\h\w*/ transparent contains=NONE

" Types stand behind a colon.
syn match mauveColon /::\@!/ nextgroup=mauveType skipwhite
syn match mauveType /\h\w*\%(\s*\%(\.\|::\)\s*\h\w*\)*/ contained contains=mauveBuiltinType
syn keyword mauveBuiltinType contained bool int double float string void
syn keyword mauveBuiltinType contained int8_t int16_t int32_t int64_t uint8_t uint16_t uint32_t uint64_t

" Declarations
syn match mauveInclude /^\s*\zsinclude\ze\s*"/
syn match mauveInclude /\<\%(use\|import\)\ze\s\+\h/ nextgroup=mauveName skipwhite
syn match mauveStructure /\<\%(library\|shell\|core\|component\|architecture\|deployment\)\ze\s\+\h/
      \ nextgroup=mauveTypeName skipwhite
syn match mauveTypeName /\h\w*/ contained nextgroup=mauveHeader,mauveExtends skipwhite
syn region mauveHeader matchgroup=NONE start=/(/ end=/)/ contained contains=mauveType,mauveComment oneline
syn match mauveExtends /extends\ze\s\+\h/ contained nextgroup=mauveBase skipwhite
syn match mauveBase /\h\w*\%(\s*[.,:]\+\s*\h\w*\)*/ contained
syn match mauveKeyword /\<codel\ze\s\+\h/ nextgroup=mauveFunction skipwhite
syn match mauveFunction /\h\w*/ contained

" Shells, cores, state machines
syn match mauveModifier /\<\%(in\|out\|inout\)\ze\s\+\h\w*\s*:/ nextgroup=mauveName skipwhite
syn match mauveKeyword /\<\%(input\|output\)\ze\s\+port\>/ nextgroup=mauvePort skipwhite
syn match mauvePort /port/ contained nextgroup=mauveName skipwhite
syn match mauveKeyword /\<\%(require\|provide\)\ze\s\+\h\w*\s*(/ nextgroup=mauveFunction skipwhite
syn match mauveKeyword /\<\%(constant\|property\|instance\|var\|handler\)\ze\s\+\h/ nextgroup=mauveName skipwhite
syn match mauveKeyword /\<statemachine\ze\%(\s*{\|\s*$\)/
syn match mauveKeyword /\<\%(configure\|start\|update\|stop\|cleanup\|entry\|run\|handle\|exit\)\ze\s*=\%(\s*{\|\s*$\)/
syn match mauveKeyword /\<initial\ze\s\+state\>/ nextgroup=mauveState skipwhite
syn match mauveState /\<state\ze\s\+\h/ nextgroup=mauveLabel skipwhite
syn match mauveKeyword /\<transition\ze\s\+\h/ nextgroup=mauveLabel skipwhite
syn match mauveTo /\<to\ze\s\+\h/ nextgroup=mauveLabel skipwhite
syn match mauveLabel /\h\w*/ contained

" Architectures and deployments
syn match mauveKeyword /\<\%(connection\|operation\)\ze\s\+\h\w*\s*\./ nextgroup=mauveName skipwhite
syn match mauveKeyword /\<activity\ze\s\+\h/ nextgroup=mauveActivity skipwhite
syn match mauveActivity /\h\w*/ contained nextgroup=mauveFields skipwhite skipempty
syn region mauveFields start=/{/ end=/}/ contained
      \ contains=mauveField,mauveBackground,mauveNumber,mauveOperator,mauveComment
syn keyword mauveField contained instances thread order affinity cpus priority preemptive trigger least period rate burst deadline jitter offset
syn keyword mauveBackground contained background

" A name that is not coloured, and is no keyword either.
syn match mauveName /\h\w*/ contained

syn region mauveString start=/"/ skip=/\\./ end=/"\|$/ contains=mauveEscape,@Spell
syn match mauveEscape /\\["\\nt]/ contained
syn match mauveComment "//.*" contains=mauveTodo,@Spell
syn region mauveComment start="/\*" end="\*/" contains=mauveTodo,@Spell fold
syn keyword mauveTodo contained TODO FIXME XXX NOTE

syn sync ccomment mauveComment

hi def link mauveActivity Identifier
hi def link mauveBackground Constant
hi def link mauveBase Type
hi def link mauveBoolean Boolean
hi def link mauveBuiltin Special
hi def link mauveBuiltinType Type
hi def link mauveCall Function
hi def link mauveComment Comment
hi def link mauveConditional Conditional
hi def link mauveEscape SpecialChar
hi def link mauveExtends Keyword
hi def link mauveField Keyword
hi def link mauveFunction Function
hi def link mauveInclude Include
hi def link mauveKeyword Keyword
hi def link mauveLabel Identifier
hi def link mauveModifier StorageClass
hi def link mauveNumber Number
hi def link mauveOperator Operator
hi def link mauvePort Keyword
hi def link mauveState Keyword
hi def link mauveStatement Statement
hi def link mauveStatus Constant
hi def link mauveString String
hi def link mauveStructure Keyword
hi def link mauveTo Keyword
hi def link mauveTodo Todo
hi def link mauveType Type
hi def link mauveTypeName Type

let b:current_syntax = 'mauve'
