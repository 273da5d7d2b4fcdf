from flexura.study.questions.answers import Answers as Answers
from flexura.study.questions.catalogue import Quantity as Quantity
from flexura.study.questions.formulas import Formula as Formula
from flexura.study.questions.formulas import Relation as Relation
from flexura.study.questions.formulas import formula as formula
from flexura.study.questions.formulas import relation as relation
from flexura.study.questions.questions import Questions as Questions
from flexura.study.questions.questions import questions as questions
