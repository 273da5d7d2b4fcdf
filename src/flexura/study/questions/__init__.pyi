from flexura.study.questions.answers import Answers as Answers
from flexura.study.questions.catalogue import Quantity as Quantity
from flexura.study.questions.questions import Questions as Questions
from flexura.study.questions.questions import questions as questions
