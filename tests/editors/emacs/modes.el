;;; modes.el --- Checks of the major modes, without a server  -*- lexical-binding: t -*-

;; Run by ./run, with the folder of the sample robot.

;;; Code:

(setq mauve-start-server nil)
(defvar robot (pop command-line-args-left))

(defun check (expected seen about)
  "Fail unless EXPECTED is SEEN, with ABOUT in the message."
  (unless (equal expected seen)
    (error "Expected %S, not %S: %s" expected seen about)))

(defun mode-of (text)
  "Return the major mode of a new `.mal' file with TEXT."
  (let ((file (make-temp-file "mode" nil ".mal" text)))
    (unwind-protect
        (with-current-buffer (find-file-noselect file)
          (prog1 major-mode (kill-buffer)))
      (delete-file file))))

;; The texts with which the plugin for Neovim is tested, too.
(dolist (text '(""
                "// A comment\n\nlibrary a {\n}"
                "/* #id: \"x\"\n category Y {\n*/ \ninclude \"a.mal\"\n  codel f(): int"
                "\ufeffdeployment D {"
                "activity half { typed"
                "library\r\n{\r\n}"
                "include \"a.mal\"\n"
                "category"))
  (check 'mauve-mode (mode-of text) text))
(dolist (text '("\ufeff#id : \"x\""
                "#id: \"org.example.lang\"\n#version: \"1.0.0\""
                "// Licence\ninclude \"core.mal\"\ncategory System {\n  asset Host {"
                "associations {\n  Host [host] 1 <-- Runs --> * [apps] Application"
                "category A\n{\n  abstract asset use {"
                ";; A Lisp\n(def! x 1)"))
  (check 'fundamental-mode (mode-of text) text))

(dolist (file (directory-files-recursively robot "\\.mal\\'"))
  (with-current-buffer (find-file-noselect file)
    (check 'mauve-mode major-mode file)
    (let ((text (buffer-string)))
      (let ((inhibit-message t))
        (indent-region (point-min) (point-max)))
      (check text (buffer-string) file))
    (set-buffer-modified-p nil)))

(defun face-of (word &optional nth)
  "Return the face of the NTH occurrence of WORD."
  (goto-char (point-min))
  (let ((case-fold-search nil))
    (re-search-forward (concat "\\_<" word "\\_>") nil nil (or nth 1)))
  (get-text-property (match-beginning 0) 'face))

;; A keyword that is a name has the colour of a name.
(with-temp-buffer
  (insert "shell start {\n  input port state: int  // a shell\n}\ncore C(start) {\n  statemachine {\n"
          "    initial state entry {\n      run = { state = read(state); }\n      transition to if (state) to to\n")
  (let ((mauve-start-server nil))
    (mauve-mode))
  (font-lock-ensure)
  (check 'font-lock-keyword-face (face-of "shell") "shell")
  (check 'font-lock-type-face (face-of "start") "start")
  (check 'font-lock-variable-name-face (face-of "state") "state")
  (check 'font-lock-type-face (face-of "int") "int")
  (check 'font-lock-comment-face (face-of "shell" 2) "shell in a comment")
  (check 'font-lock-keyword-face (face-of "state" 2) "state")
  (check 'font-lock-constant-face (face-of "entry") "entry")
  (check 'font-lock-keyword-face (face-of "run") "run")
  (check nil (face-of "state" 3) "a variable")
  (check 'font-lock-builtin-face (face-of "read") "read"))

(find-file (expand-file-name "mauve.toml" robot))
(check 'mauve-toml-mode major-mode "mauve.toml")

(dolist (name '("threads.yaml" "mauve.yaml"))
  (find-file (expand-file-name name robot))
  (check (equal name "threads.yaml") (eq major-mode 'mauve-yaml-mode) name))
(find-file (expand-file-name "../threads.yaml" robot))
(check nil (eq major-mode 'mauve-yaml-mode) "threads.yaml of another project")

;;; modes.el ends here
