[(stream) (hands) (choices) (relabel)] @fold
(comment)+ @fold
(doc_comment)+ @fold
