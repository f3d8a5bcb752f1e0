" Rule files of teachtree: what the grammar reserves, and what is said in its place. `teachtree lsp` knows the rest.
if exists('b:current_syntax')
  finish
endif

syntax case match
" Where Vim keeps words of the language apart from names that look like them, it does so by what follows.
syntax keyword teachtreeKeyword above and become becomes below between clear else extend false for from in latch none not optional or param per primitive relabel separate sequence set settle signal stay stream task tree true until use with within without
syntax match teachtreeKeyword /\<each\s\+hand\>/
syntax match teachtreeKeyword /\(\<within\s\+\)\@<=\(last\|next\)\>/
syntax match teachtreeKeyword /\<over\s\+last\>/
syntax match teachtreeKeyword /\<since\ze\s\+\(\w\|(\)/
syntax match teachtreeKeyword /)\s*\zsat\s\+least\>/
syntax match teachtreeKeyword /)\s*\zs\(bridging\|lasting\)\ze\s\+\(\w\|(\)/
syntax match teachtreeKeyword /\<times\ze\s\+within\>/
syntax match teachtreeKeyword /\(\<in\s\+\)\@<=\(both\|one\s\+hand\|the\s\+other\)\>/
syntax match teachtreeKeyword /\<shorter\s\+than\>/
syntax match teachtreeKeyword /\<while\s\+other\ze\s\+does\>/
syntax match teachtreeKeyword /\<is\ze\s\+[A-Z]/
syntax match teachtreeKeyword /\<is\s\+failure\>/
syntax match teachtreeKeyword /\<does\ze\s\+\w/
syntax match teachtreeKeyword /,\s*\zsjoined\>/
syntax match teachtreeKeyword /\<\(first\|last\)\ze\s*{/
syntax match teachtreeKeyword /\<\(before\|after\)\ze\s\+\("\|\w\)/
syntax match teachtreeKeyword /\<\(lasting\|travelling\|turning\)\ze\s\+\([0-9(]\|\(\(above\|and\|become\|becomes\|below\|between\|clear\|else\|extend\|false\|for\|from\|in\|latch\|none\|not\|optional\|or\|param\|per\|primitive\|relabel\|separate\|sequence\|set\|settle\|signal\|stay\|stream\|task\|tree\|true\|until\|use\|with\|within\|without\)\>\)\@![A-Za-z_]\)/
syntax match teachtreeType /:\s*\zs\(bool\|scalar\|vec3\|rotation\|object\)\>/
syntax match teachtreeFunction /\<\(abs\|all\|angle\|any\|count\|cross\|dot\|earliest\|falls\|from_frame\|in_contact\|in_frame\|integral\|max\|mean\|min\|norm\|rate\|rises\|squeeze_of\|sum\|tangential\|vec3\)\ze\s*(/
syntax match teachtreePrimitive /\<[A-Z]\w*\>/
syntax match teachtreeNumber /\<\d\+\(\.\d\+\)\?\([eE][+-]\?\d\+\)\?/ nextgroup=teachtreeUnit skipwhite
syntax match teachtreeUnit /\(%\|\<\(mm\|cm\|um\|ms\|mN\|kg\|rad\|deg\|kHz\|Hz\|m\|s\|N\|g\)\>\)\(\^-\?\d\+\)\?/ contained nextgroup=teachtreeUnitOver,teachtreeUnit skipwhite
syntax match teachtreeUnitOver /\(\/\/\)\@![\/·]/ contained nextgroup=teachtreeUnit skipwhite
syntax match teachtreeString /"[^"]*"\?/
syntax match teachtreeComment /\/\/.*$/ contains=@Spell
syntax match teachtreeDoc /\/\/\/.*$/ contains=@Spell

highlight default link teachtreeKeyword Keyword
highlight default link teachtreeType Type
highlight default link teachtreeFunction Function
highlight default link teachtreePrimitive Constant
highlight default link teachtreeNumber Number
highlight default link teachtreeUnit Special
highlight default link teachtreeString String
highlight default link teachtreeComment Comment
highlight default link teachtreeDoc SpecialComment

let b:current_syntax = 'teachtree'
