;;; mauve.el --- Response times of robots that are described in MAUVE  -*- lexical-binding: t -*-

;; Package-Requires: ((emacs "29.1"))
;; SPDX-License-Identifier: MIT OR Apache-2.0

;;; Commentary:

;; Major modes for MAUVE models (`.mal'), for the configuration and the timing table of a project, and for the `threads.yaml' of
;; its executor.  They start the language server `mauve lsp' with Eglot, which shows response times as inlay hints.

;;; Code:

(require 'conf-mode)
(require 'eieio)
(require 'project)

(defgroup mauve nil
  "Component-based real-time robots."
  :group 'languages)

(defcustom mauve-program "mauve"
  "The program that runs the language server: a name on PATH, or an absolute path."
  :type 'string
  :risky t)

(defcustom mauve-start-server t
  "Whether the modes start the language server."
  :type 'boolean)

;;; Which files are ours

(defconst mauve--ours
  "\\(?:library\\|use\\|codel\\|shell\\|core\\|component\\|architecture\\|deployment\\)\\(?:[ \t\r]\\|$\\)"
  "The beginning of a line that only MAUVE has.")

(defconst mauve--not-ours
  (concat "#[[:alnum:]]+[ \t]*:\\|category[ \t]+[[:alnum:]]\\|abstract[ \t]+asset\\(?:[ \t\r]\\|$\\)"
          "\\|asset[ \t]+[[:alnum:]]\\|associations[ \t]*{\\|[(;]")
  "The beginning of a line of the Meta Attack Language, or of \"Make a Lisp\".")

(defun mauve--ours-p ()
  "Return whether the buffer holds MAUVE: the first line that tells decides.
A text where no line does is ours: a new one, or an incomplete one."
  (let ((case-fold-search nil) (answer 'unknown) (lines 500))
    (save-excursion
      (save-restriction
        (widen)
        (goto-char (point-min))
        (skip-chars-forward "\ufeff")
        (while (and (eq answer 'unknown) (> lines 0) (not (eobp)))
          (skip-chars-forward " \t")
          (cond
           ((looking-at-p "/\\*")
            ;; A comment, which ends with its line at the earliest.
            (unless (search-forward "*/" nil t)
              (goto-char (point-max))))
           ((looking-at-p mauve--ours) (setq answer t))
           ((looking-at-p mauve--not-ours) (setq answer nil)))
          (setq lines (1- lines))
          (forward-line))))
    (and answer t)))

;;;###autoload
(defun mauve-recognise ()
  "Select the major mode of a `.mal' file by its content.
The Meta Attack Language and \"Make a Lisp\" have the same extension."
  (if (mauve--ours-p)
      (mauve-mode)
    (mauve--leave #'mauve-recognise)))

;;;###autoload
(defun mauve-recognise-yaml ()
  "Select the major mode of a `threads.yaml': other projects may have one."
  (if (locate-dominating-file default-directory "mauve.toml")
      (mauve-yaml-mode)
    (mauve--leave #'mauve-recognise-yaml)))

(defun mauve--leave (function)
  "Select the major mode that a file has without FUNCTION."
  (let ((auto-mode-alist (rassq-delete-all function (copy-sequence auto-mode-alist))))
    (set-auto-mode)))

;;; Syntax

(defvar mauve-mode-syntax-table
  (let ((table (make-syntax-table)))
    (modify-syntax-entry ?/ ". 124b" table)
    (modify-syntax-entry ?* ". 23" table)
    (modify-syntax-entry ?\n "> b" table)
    (modify-syntax-entry ?\" "\"" table)
    (modify-syntax-entry ?\\ "\\" table)
    (modify-syntax-entry ?_ "_" table)
    (dolist (operator '(?+ ?- ?= ?% ?< ?> ?& ?| ?!))
      (modify-syntax-entry operator "." table))
    table)
  "Syntax table of `mauve-mode'.")

(defvar mauve--font-lock
  ;; Each keyword is contextual: a port may be called `state'.  So a keyword is matched with its successor.
  (let* ((name "\\([[:alpha:]_][[:alnum:]_]*\\)")
         (before (lambda (words after)
                   (concat "\\_<" (regexp-opt words t) "\\_>" after))))
    `((,(funcall before '("library" "shell" "core" "component" "architecture" "deployment") (concat "\\s-+" name))
       (1 'font-lock-keyword-face) (2 'font-lock-type-face))
      (,(funcall before '("include") "\\s-*\"") (1 'font-lock-preprocessor-face))
      (,(funcall before '("use" "import" "extends") (concat "\\s-+" name))
       (1 'font-lock-keyword-face) (2 'font-lock-type-face))
      (,(funcall before '("codel" "require" "provide") (concat "\\s-+" name))
       (1 'font-lock-keyword-face) (2 'font-lock-function-name-face))
      (,(concat "\\_<\\(input\\|output\\)\\s-+\\(port\\)\\s-+" name)
       (1 'font-lock-keyword-face) (2 'font-lock-keyword-face) (3 'font-lock-variable-name-face))
      (,(funcall before '("in" "out" "inout") (concat "\\s-+" name "\\s-*:"))
       (1 'font-lock-keyword-face) (2 'font-lock-variable-name-face))
      (,(funcall before '("constant" "property" "instance" "var" "handler" "activity") (concat "\\s-+" name))
       (1 'font-lock-keyword-face) (2 'font-lock-variable-name-face))
      (,(funcall before '("statemachine") "\\s-*\\(?:{\\|$\\)") (1 'font-lock-keyword-face))
      (,(funcall before '("configure" "start" "update" "stop" "cleanup" "entry" "run" "handle" "exit")
                 "\\s-*=\\s-*\\(?:{\\|$\\)")
       (1 'font-lock-keyword-face))
      (,(concat "\\_<\\(initial\\)\\s-+state\\_>") (1 'font-lock-keyword-face))
      (,(funcall before '("state" "transition" "to") (concat "\\s-+" name))
       (1 'font-lock-keyword-face) (2 'font-lock-constant-face))
      (,(funcall before '("connection" "operation") (concat "\\s-+" name "\\s-*\\."))
       (1 'font-lock-keyword-face))
      (,(funcall before '("instances" "thread" "order" "affinity" "cpus" "priority" "preemptive" "trigger" "least" "period" "rate" "burst" "deadline" "jitter" "offset") "\\s-*=")
       (1 'font-lock-property-name-face))
      (,(funcall before '("if" "then" "else" "return") "\\s-*\\(?:[^=[:space:]]\\|==\\|$\\)")
       (1 'font-lock-keyword-face))
      (,(funcall before '("read" "write" "status" "send" "collect") "\\s-*(") (1 'font-lock-builtin-face))
      (,(funcall before '("true" "false" "no_data" "old_data" "new_data" "failure" "success" "not_ready" "background") "")
       (1 'font-lock-constant-face))
      (,(concat ":\\s-*" (regexp-opt '("bool" "int" "double" "float" "string" "void" "int8_t" "int16_t" "int32_t"
                                       "int64_t" "uint8_t" "uint16_t" "uint32_t" "uint64_t")
                                     t)
                "\\_>")
       (1 'font-lock-type-face))
      (,(concat ":\\s-*" name) (1 'font-lock-type-face))))
  "Highlighting without a server.")

(defun mauve--column-in-parentheses (open)
  "Return the column of the text behind the parenthesis at OPEN in its line."
  (when (and open (eq (char-after open) ?\())
    (save-excursion
      (goto-char (1+ open))
      (skip-chars-forward " \t")
      (unless (eolp) (current-column)))))

(defun mauve-indent-line ()
  "Indent a line by the brackets that are open at its beginning."
  (interactive)
  (let ((state (save-excursion (syntax-ppss (line-beginning-position))))
        (column (current-column)))
    (unless (nth 8 state)
      (let* ((open (reverse (nth 9 state)))
             (closing (save-excursion
                        (back-to-indentation)
                        (skip-chars-forward "])}")))
             (left (nthcdr closing open))
             (lines (delete-dups (mapcar #'line-number-at-pos left)))
             (indentation (current-indentation)))
        (indent-line-to (or (mauve--column-in-parentheses (car left)) (* 2 (length lines))))
        (when (> column indentation)
          (move-to-column (+ column (- (current-indentation) indentation))))))))

;;; The server

(defun mauve--project (directory)
  "Return the project of DIRECTORY: the nearest folder with a `mauve.toml'."
  (when-let* ((root (locate-dominating-file directory "mauve.toml")))
    (cons 'mauve root)))

(cl-defmethod project-root ((project (head mauve)))
  "Return the folder of PROJECT."
  (cdr project))

;; Eglot asks for the hints of a buffer when that buffer changes.  Response times also change with other files: then the server
;; requests a refresh, which Eglot does not support for all servers.
(defvar eglot-server-programs)
(declare-function eglot-current-server "eglot")
(declare-function jsonrpc-async-request "jsonrpc")

(with-eval-after-load 'eglot
  (defclass mauve-server (eglot-lsp-server) ((verdict :initform nil) (timer :initform nil))
    "The MAUVE language server, with its last verdict and the timer of the next request for one.")

  (cl-defmethod eglot-client-capabilities ((_server mauve-server))
    "Return the capabilities of Eglot, with the refresh of inlay hints."
    (let* ((all (copy-sequence (cl-call-next-method)))
           (workspace (copy-sequence (plist-get all :workspace))))
      (plist-put all :workspace (plist-put workspace :inlayHint '(:refreshSupport t)))))

  (cl-defmethod eglot-handle-request ((server mauve-server) (_method (eql workspace/inlayHint/refresh)) &rest _)
    "Request the hints of all buffers of SERVER again."
    (dolist (buffer (buffer-list))
      (with-current-buffer buffer
        (when (and (bound-and-true-p eglot-inlay-hints-mode) (eq (eglot-current-server) server))
          ;; Else Eglot does not repeat a request for the region of the last one.
          (setq-local eglot--outstanding-inlay-hints-last-region nil)
          (jit-lock-refontify))))
    (mauve--request-verdict server)
    nil)

  (cl-defmethod eglot-handle-notification :after
    ((server mauve-server) (_method (eql textDocument/publishDiagnostics)) &rest _)
    "Request the verdict: the diagnostics of SERVER come with each analysis."
    (mauve--request-verdict server))

  (add-to-list 'eglot-server-programs
               `((mauve-mode (mauve-toml-mode :language-id "toml") (mauve-yaml-mode :language-id "yaml"))
                 . ,(lambda (&rest _) (list 'mauve-server mauve-program "lsp")))))

;;; The verdict

(defun mauve--request-verdict (server)
  "Request the verdict of SERVER soon, again while it works, and show it in the header lines."
  (unless (slot-value server 'timer)
    (setf (slot-value server 'timer)
          (run-with-timer
           0.3 nil
           (lambda ()
             (setf (slot-value server 'timer) nil)
             (when (jsonrpc-running-p server)
               (jsonrpc-async-request
                server :mauve/status nil
                :success-fn (lambda (status)
                              (if-let* ((verdict (plist-get status :verdict)))
                                  (progn (setf (slot-value server 'verdict) verdict)
                                         (force-mode-line-update t))
                                (mauve--request-verdict server)))
                :error-fn #'ignore)))))))

(defvar mauve--header-map
  (let ((map (make-sparse-keymap)))
    (define-key map [header-line mouse-1] #'flymake-show-project-diagnostics)
    map)
  "What a click on the verdict does.")

(defun mauve--header ()
  "Return the verdict as a header line."
  (when-let* ((server (and (fboundp 'eglot-current-server) (eglot-current-server)))
              ((slot-exists-p server 'verdict))
              (verdict (slot-value server 'verdict)))
    (propertize (concat " MAUVE " (string-replace "%" "%%" (plist-get verdict :text)))
                ;; Colours are made for the background of the text.
                'face (list (pcase (plist-get verdict :status)
                              ("missed" 'error) ((or "tight" "unknown") 'warning) ("met" 'success))
                            'default)
                'help-echo "mouse-1: list the problems of all files"
                'local-map mauve--header-map)))

;;; The command line

;;;###autoload
(defun mauve-command (arguments)
  "Run `mauve' with ARGUMENTS in the folder of the project, and show its output.
`run' runs the deployment on this computer, its response times beside their bounds; `trace import' and `trace check' read
recordings."
  (interactive (list (read-string "mauve " "run --for 10s --simulate-time")))
  (let ((default-directory (or (locate-dominating-file default-directory "mauve.toml") default-directory)))
    (compile (concat (shell-quote-argument mauve-program) " " arguments))))

;;; The modes start the server

(declare-function eglot-ensure "eglot")

(defun mauve--start ()
  "Start the language server for this buffer, unless the user has switched it off."
  (add-hook 'project-find-functions #'mauve--project nil t)
  (setq-local header-line-format '((:eval (mauve--header))))
  (when (and mauve-start-server buffer-file-name)
    (if (executable-find mauve-program)
        (eglot-ensure)
      (message "mauve: cannot run \"%s\": install it, or set `mauve-program'" mauve-program))))

;;; Modes

;;;###autoload
(define-derived-mode mauve-mode prog-mode "MAUVE"
  "Major mode for MAUVE models."
  (setq-local comment-start "// "
              comment-end ""
              comment-start-skip "\\(?://+\\|/\\*+\\)\\s-*"
              indent-tabs-mode nil
              tab-width 2
              indent-line-function #'mauve-indent-line
              electric-indent-chars (append "{})]" electric-indent-chars)
              font-lock-defaults '(mauve--font-lock)
              imenu-generic-expression
              '((nil "^\\s-*\\(?:library\\|codel\\|shell\\|core\\|component\\|architecture\\|deployment\\)\\s-+\\([[:alnum:]_]+\\)" 1)))
  (mauve--start))

;;;###autoload
(define-derived-mode mauve-toml-mode conf-toml-mode "MAUVE TOML"
  "Major mode for the configuration and the timing table of a MAUVE project."
  ;; Other projects may have a `timing.toml'.
  (when (locate-dominating-file default-directory "mauve.toml")
    (mauve--start)))

(declare-function yaml-mode "yaml-mode")

(defun mauve--yaml-mode ()
  "Run the major mode for YAML that this Emacs has."
  (cond ((fboundp 'yaml-mode) (yaml-mode))
        ((and (fboundp 'treesit-ready-p) (treesit-ready-p 'yaml t)) (yaml-ts-mode))
        (t (conf-colon-mode))))

;;;###autoload
(define-derived-mode mauve-yaml-mode mauve--yaml-mode "MAUVE YAML"
  "Major mode for the threads of an executor of ROS 2."
  (mauve--start))

(provide 'mauve)

;;; mauve.el ends here
