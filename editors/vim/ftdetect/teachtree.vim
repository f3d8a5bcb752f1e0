" Other programs have files that end in `.rules` too: one of ours begins, behind comments, with a word that begins declarations.
function! s:Detect() abort
  for line in getline(1, 200)
    if line =~# '^\s*\(//.*\)\?$'
      continue
    endif
    if line =~# '^\s*\(use\s\+"\|stream\s*{\|\(param\|signal\|latch\|primitive\|tree\|extend\|task\)\s\+\w\|relabel\>\|for\s\+each\s\+hand\>\)'
      setlocal filetype=teachtree
    endif
    return
  endfor
endfunction

autocmd BufNewFile,BufRead *.rules call s:Detect()
